use super::seen_tables::SeenTables;
use super::snapshot_file::Snapshot;
use super::snapshot_list::{MAX_SNAPSHOTS, SnapshotList};
use super::snapshot_name::SnapshotName;
use crate::error::{Error, FormatError, Result};
use crate::store::commit::commit_log::CommitLog;
use crate::store::commit::commits::Commits;
use crate::store::commit::metadata::Metadata;
use crate::store::disk::EntryKind;
use crate::store::scans::{CatalogEntry, CatalogVersion};
use crate::store::tile_store::TileStore;
use std::io;

/// Creates and deletes the snapshots of a map. Each change is a commit of its own, without other changes.
#[derive(Debug)]
pub struct SnapshotWriter<'a> {
    pub(super) store: &'a mut TileStore,
}

impl SnapshotWriter<'_> {
    /// Creates a snapshot of the last commit. Its tables are kept on disk when later flushes replace them. Uncommitted
    /// changes are not part of the snapshot. When this returns the snapshot is durable; after an error there is none.
    ///
    /// If a snapshot of this name and this state exists, nothing is done.
    ///
    /// # Errors
    ///
    /// [`Error::AlreadyExists`] if a snapshot of this name and another state exists; a map of the original format,
    /// which must be upgraded first; or an I/O error.
    pub fn create(&mut self, name: &SnapshotName) -> Result<()> {
        self.store.finish_earlier_work()?;
        let map_id = self.store.committer.logged_map_id()?;
        let folder = self.store.layout().snapshots();
        let has_folder = Snapshot::has_folder(&**self.store.disk(), self.store.layout())?;
        if !self.check_name(name)? {
            log::info!("{}: the snapshot {name} already has this state", self.store.folder().display());
            return Ok(());
        }
        let mut listed = self.store.committer.snapshots().cloned().unwrap_or_default();
        if !has_folder {
            self.store.disk().create_folder(&folder).map_err(|error| Error::io(&folder, "create", error))?;
        }
        // An earlier attempt may have created the folder without a sync.
        self.store.files.sync_map_folder()?;
        let next = self.store.layout().snapshot_next();
        let flush_number = self.store.commits().flush_number;
        self.store.name_own_catalog();
        self.write_next(name, map_id, self.store.metadata(), self.store.commits())?;
        self.store.files.sync_folder(&folder)?;
        listed.insert(name.clone(), Some(flush_number));
        if let Err(error) = self.store.commit_snapshots(listed) {
            // A failed removal is harmless: snapshots that the log does not list are ignored and removed later.
            let _ = self.store.disk().remove_file(&next);
            return Err(error);
        }
        // Committed.
        self.store.kept.share(self.store.versions.commits().tiles.tiles());
        self.store.checkpoint.name_snapshot(name);
        self.finish_commit();
        Ok(())
    }

    /// Checks that a snapshot of this name can be created. Returns false if there is one of the last commit.
    ///
    /// # Errors
    ///
    /// As for [`Self::create`]. Nothing is changed.
    pub fn check_name(&self, name: &SnapshotName) -> Result<bool> {
        let path = self.store.layout().snapshot(name);
        let has_folder = Snapshot::has_folder(&**self.store.disk(), self.store.layout())?;
        let listed = self.store.committer.snapshots().cloned().unwrap_or_default();
        if listed.contains(name) && self.is_kept_as(name) {
            return Ok(false);
        }
        if listed.contains(name) || has_folder && self.store.files.kind(&path)?.is_some() {
            let hint = "choose another name, or delete that snapshot first";
            return Err(Error::AlreadyExists { path, hint });
        }
        if listed.len() >= MAX_SNAPSHOTS {
            let (size, limit) = (listed.len() as u64 + 1, MAX_SNAPSHOTS as u64);
            let hint = "delete snapshots first";
            return Err(Error::TooLarge { what: "the number of snapshots", size, limit, hint });
        }
        Ok(true)
    }

    /// Returns whether a snapshot of this name is readable and has the state of the last commit.
    fn is_kept_as(&self, name: &SnapshotName) -> bool {
        self.store
            .snapshots()
            .read(name)
            .and_then(|snapshot| self.store.is_as(&self.store.at(&snapshot)))
            .unwrap_or(false)
    }

    /// Replaces the content of a snapshot.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn replace(&mut self, snapshot: &Snapshot) -> Result<()> {
        let Snapshot { name, map_id, metadata, commits, .. } = snapshot;
        let (next, path) = (self.store.layout().snapshot_next(), self.store.layout().snapshot(name));
        self.write_next(name, *map_id, metadata, commits)?;
        self.store.disk().rename(&next, &path).map_err(|error| Error::io(&path, "replace", error))?;
        self.store.files.sync_folder(&self.store.layout().snapshots())
    }

    /// Finishes a commit. After an I/O error the next call resumes.
    fn finish_commit(&mut self) {
        if let Err(error) = self.store.finish_commit() {
            log::warn!("{}: committed, but the cleanup failed: {error:#}", self.store.folder().display());
        }
    }

    fn write_next(
        &self,
        name: &SnapshotName,
        map_id: [u8; 16],
        metadata: &Metadata,
        commits: &Commits,
    ) -> Result<()> {
        let mut metadata = metadata.as_of(commits);
        if let Some(ext) = &mut metadata.ext {
            ext.snapshots = Some(SnapshotList::of(name.clone(), commits.flush_number));
        }
        let next = self.store.layout().snapshot_next();
        CommitLog::write_whole(&**self.store.disk(), &next, map_id, commits, &metadata.to_text())
            .map_err(|error| Error::io(&next, "write", error))?;
        Ok(())
    }

    /// Deletes a snapshot, and the tables that no other snapshot uses. Damaged, unreadable and missing snapshots can be
    /// deleted too. If a deletion was interrupted after its commit, opening the map has finished it, and this returns
    /// without an error.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] if there is no snapshot of this name, or an I/O error. If unneeded kept scans could
    /// not be removed, because of an I/O error or a damaged catalog, the snapshot is deleted, and the next call tries
    /// to remove them.
    pub fn delete(&mut self, name: &SnapshotName) -> Result<()> {
        self.store.finish_earlier_work()?;
        let path = self.store.layout().snapshot(name);
        let is_listed = self.store.committer.snapshots().is_some_and(|listed| listed.contains(name));
        match self.store.disk().kind(&path) {
            Ok(Some(EntryKind::File(_))) => {}
            Ok(Some(_)) if Snapshot::has_folder(&**self.store.disk(), self.store.layout()).is_ok() => {
                let reason = "not a regular file; `voxtile repair` moves it to quarantine";
                return Err(FormatError::at_offset(0, reason).in_map(&path, None));
            }
            _ if is_listed => {}
            // Deleted by an attempt that was killed after its commit.
            Ok(_) if self.store.snapshots_removed.contains(name) => return Ok(()),
            // Returns the error for an unknown snapshot.
            Ok(_) => return self.store.snapshots().read(name).map(drop),
            Err(error) => return Err(Error::io(&path, "access", error)),
        }
        let mut listed = self.store.committer.snapshots().cloned().unwrap_or_default();
        listed.remove(name);
        if self.store.map_id().is_some() {
            self.store.commit_snapshots(listed)?;
        }
        self.finish_commit();
        // As long as the file exists, this call can be repeated to finish the deletion.
        if let Err(error) = self.release_unseen_tables() {
            log::warn!("deleted, but its tables remain until the map is opened again: {error:#}");
        }
        self.store.release_scans().map_err(|error| scans_remain(error, name))?;
        self.store.checkpoint.remove_snapshot(name);
        self.finish_commit();
        Ok(())
    }

    /// Removes snapshots without files from the list, and the files that were kept for them.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn give_up(&mut self, names: &[SnapshotName]) -> Result<()> {
        self.store.finish_earlier_work()?;
        let mut listed = self.store.committer.snapshots().cloned().unwrap_or_default();
        let mut is_changed = false;
        for name in names {
            is_changed |= listed.remove(name);
        }
        if is_changed {
            self.store.commit_snapshots(listed)?;
            self.finish_commit();
            self.release_unseen()?;
        }
        Ok(())
    }

    /// Reads the snapshots again, and removes kept tables and kept scans that neither they nor readers need.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn release_unseen(&mut self) -> Result<()> {
        self.release_unseen_tables()?;
        self.store.remove_unneeded_scans();
        Ok(())
    }

    fn release_unseen_tables(&mut self) -> Result<()> {
        let Some(map_id) = self.store.map_id() else { return Ok(()) };
        let (listed, pinned) = (self.store.committer.snapshots(), self.store.kept.snapshots().pinned());
        let tiles: Vec<_> = pinned.keys().copied().collect();
        let snapshots = SeenTables::read_all(
            &**self.store.disk(),
            self.store.layout(),
            map_id,
            self.store.commits(),
            listed,
            pinned,
        )?;
        self.store.kept.set_snapshots(snapshots);
        self.store.kept.release(&self.store.files);
        for tile in tiles.into_iter().filter(|tile| !self.store.commits().tiles.contains(*tile)) {
            // Folder of a removed tile. It is removed if it is empty now.
            let _ = self.store.disk().remove_folder(&self.store.layout().tile_folder(tile));
        }
        Ok(())
    }

    /// Writes a catalog for a snapshot in a commit of its own. Nothing uses the catalog until the snapshot's file names
    /// it.
    ///
    /// # Errors
    ///
    /// An I/O error, or a damaged catalog of the map itself, if an older version wrote the map and did not record its
    /// catalog.
    pub(crate) fn write_catalog(
        &mut self,
        write: impl FnOnce(&mut dyn FnMut(&CatalogEntry) -> Result<()>) -> Result<()>,
    ) -> Result<CatalogVersion> {
        self.store.finish_earlier_work()?;
        // After this, the newest catalog is not the map's own, so the log must name the map's own.
        self.store.try_to_name_own_catalog()?;
        let catalog = self.store.archive.write_other(write)?;
        let listed = self.store.snapshots().list().cloned().unwrap_or_default();
        self.store.commit_snapshots(listed)?;
        self.store.tidy_up();
        Ok(catalog)
    }
}

/// Returns the error of a deletion after which unneeded kept scans remain, with the remedy.
fn scans_remain(error: Error, name: &SnapshotName) -> Error {
    let hint = format!("the snapshot {name} is deleted, but points of scans that only it kept may remain");
    match error {
        Error::Io { path, action, cause } => {
            let cause = io::Error::new(cause.kind(), format!("{cause}; {hint}: delete it again"));
            Error::Io { path, action, cause }
        }
        Error::Damaged { path, tile, mut cause } => {
            cause.reason.push_str(&format!("; {hint}: repair the map"));
            Error::Damaged { path, tile, cause }
        }
        other => other,
    }
}
