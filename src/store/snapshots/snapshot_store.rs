//! SeenTables of a [`TileStore`]: made, deleted, and opened like the map itself.

use super::seen_tables::SeenTables;
use super::snapshot_file::Snapshot;
use super::snapshot_list::{MAX_SNAPSHOTS, SnapshotList};
use super::snapshot_name::SnapshotName;
use crate::error::{Error, FormatError, Result};
use crate::space::TileIndex;
use crate::store::commit::commit_log::CommitLog;
use crate::store::commit::commits::Commits;
use crate::store::commit::metadata::Metadata;
use crate::store::disk::{Disk, EntryKind};
use crate::store::layout::Layout;
use crate::store::layout::TileFile;
use crate::store::map_folder;
use crate::store::tile_store::{TileStore, id_from_hex};
use std::io;
use std::path::Path;
use std::sync::Arc;

impl TileStore {
    /// Opens a snapshot for reading, beside a writer too: takes no lock and writes nothing.
    ///
    /// # Errors
    ///
    /// No map or no snapshot of this name there; damage; a disk that refuses.
    pub fn open_snapshot(disk: Arc<dyn Disk>, folder: &Path, name: &SnapshotName) -> Result<Self> {
        let layout = Layout::new(folder);
        let metadata = map_folder::read_metadata(&*disk, &layout)?;
        let Some(map_id) = metadata.ext.as_ref().and_then(|ext| id_from_hex(&ext.map_id)) else {
            let map = folder.display();
            let reason =
                format!("{map} has none with the name {name}: a map of the original format has no snapshots");
            return Err(Error::argument("snapshot", reason));
        };
        // The log may be ahead of the file; where it cannot be read, the file is what there is.
        let listed = match Self::read(disk.clone(), layout.clone(), metadata.clone()) {
            Ok(store) => store.committer.snapshots().cloned(),
            Err(_) => metadata.ext.and_then(|ext| ext.snapshots),
        };
        let snapshot = Snapshot::read(&*disk, &layout, name, map_id, listed.as_ref())?;
        Ok(Self::of_snapshot(disk, layout, snapshot))
    }

    fn of_snapshot(disk: Arc<dyn Disk>, layout: Layout, snapshot: Snapshot) -> Self {
        let Snapshot { name, map_id, metadata, commits, .. } = snapshot;
        let mut store = Self::new(disk, layout, metadata, Some(CommitLog::of_map(map_id)), commits);
        store.opened_snapshot = Some(name);
        store
    }

    /// The map as a snapshot of it says, for reading.
    pub fn at(&self, snapshot: &Snapshot) -> Self {
        Self::of_snapshot(self.disk().clone(), self.layout().clone(), snapshot.clone())
    }

    /// The snapshot that this store was opened as.
    pub fn opened_snapshot(&self) -> Option<&SnapshotName> {
        self.opened_snapshot.as_ref()
    }

    /// The names of the map's snapshots, in order, also of those whose file is missing.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn snapshot_names(&self) -> Result<Vec<SnapshotName>> {
        match self.committer.snapshots() {
            Some(listed) => Ok(listed.names().cloned().collect()),
            None => Snapshot::list(&**self.disk(), self.layout()),
        }
    }

    /// Which snapshots the map has, as its log says; `None` if it does not.
    pub fn snapshot_list(&self) -> Option<&SnapshotList> {
        self.committer.snapshots()
    }

    /// Reads what a snapshot of this map says.
    ///
    /// # Errors
    ///
    /// As for [`Snapshot::read`].
    pub fn snapshot(&self, name: &SnapshotName) -> Result<Snapshot> {
        let map_id = self.committer.logged_map_id()?;
        Snapshot::read(&**self.disk(), self.layout(), name, map_id, self.committer.snapshots())
    }

    /// Keeps the last commit under a name, until the snapshot is deleted: from here on its tables stay when they are
    /// replaced. What is written and not committed is no part of it. When this returns it is durable; after an error
    /// there is none.
    ///
    /// Where there is one of this name and of this very state, an earlier attempt made it: nothing is done.
    ///
    /// # Errors
    ///
    /// [`Error::AlreadyExists`] if there is one of this name and of another state; a map of the original format, which
    /// must be upgraded first; a disk that refuses.
    pub fn create_snapshot(&mut self, name: &SnapshotName) -> Result<()> {
        self.finish_earlier_work()?;
        let map_id = self.committer.logged_map_id()?;
        let (folder, path) = (self.layout().snapshots(), self.layout().snapshot(name));
        let has_folder = Snapshot::has_folder(&**self.disk(), self.layout())?;
        let mut listed = self.committer.snapshots().cloned().unwrap_or_default();
        if listed.contains(name) && self.is_kept_as(name) {
            log::info!("{}: the snapshot {name} is of this state already", self.folder().display());
            return Ok(());
        }
        if listed.contains(name) || has_folder && self.files.kind(&path)?.is_some() {
            let hint = "choose another name, or delete that snapshot first";
            return Err(Error::AlreadyExists { path, hint });
        }
        if listed.len() >= MAX_SNAPSHOTS {
            let (size, limit) = (listed.len() as u64 + 1, MAX_SNAPSHOTS as u64);
            let hint = "delete some first";
            return Err(Error::TooLarge { what: "the number of snapshots", size, limit, hint });
        }
        if !has_folder {
            self.disk().create_folder(&folder).map_err(|error| Error::io(&folder, "create", error))?;
        }
        // Perhaps made by an attempt that could not.
        self.files.sync_map_folder()?;
        let next = self.layout().snapshot_next();
        let flush_number = self.commits().flush_number;
        self.name_own_catalog();
        self.write_next_snapshot(name, map_id, self.metadata(), self.commits())?;
        self.files.sync_folder(&folder)?;
        listed.insert(name.clone(), Some(flush_number));
        if let Err(error) = self.commit_snapshots(listed) {
            // Also if it stays, nothing names it.
            let _ = self.disk().remove_file(&next);
            return Err(error);
        }
        // Committed.
        self.kept.share(self.versions.commits().tiles.tiles());
        self.checkpoint.name_snapshot(name);
        self.finish_snapshot_commit();
        Ok(())
    }

    /// Whether a snapshot of this name can be read and keeps the state of the last commit.
    fn is_kept_as(&self, name: &SnapshotName) -> bool {
        self.snapshot(name).and_then(|snapshot| self.is_as(&self.at(&snapshot))).unwrap_or(false)
    }

    /// Whether the last commit left the map as `past`, a snapshot of it, says: the same tiles, scans, parameters and
    /// inputs. Flush numbers may differ: creating and deleting snapshots are flushes, too.
    ///
    /// # Errors
    ///
    /// A list of scans that is damaged; a disk that refuses.
    pub fn is_as(&self, past: &Self) -> Result<bool> {
        let without_snapshots = |store: &Self| {
            let mut metadata = store.metadata().clone();
            metadata.ext.iter_mut().for_each(|ext| ext.snapshots = None);
            metadata
        };
        let is_same = self.commits().scan_number == past.commits().scan_number
            && self.commits().tiles == past.commits().tiles
            && without_snapshots(self).is_same_but_for_progress(&without_snapshots(past));
        Ok(is_same && self.has_scans_of(past)?)
    }

    /// Writes what a snapshot says in place of what it said before.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn replace_snapshot(&self, snapshot: &Snapshot) -> Result<()> {
        let Snapshot { name, map_id, metadata, commits, .. } = snapshot;
        let (next, path) = (self.layout().snapshot_next(), self.layout().snapshot(name));
        self.write_next_snapshot(name, *map_id, metadata, commits)?;
        self.disk().rename(&next, &path).map_err(|error| Error::io(&path, "replace", error))?;
        self.files.sync_folder(&self.layout().snapshots())
    }

    /// Commits which snapshots the map has, and nothing else: what is written of tiles stays uncommitted. It is a flush
    /// of its own in the log, so that whatever ends the process is found like any other.
    pub(in crate::store) fn commit_snapshots(&mut self, listed: SnapshotList) -> Result<()> {
        self.committer.check_lock()?;
        self.name_own_catalog();
        self.keep_for_late_readers();
        match self.committer.append_snapshots(&self.files, &self.versions, listed) {
            Ok(number) => self.versions.committed_nothing(number),
            Err(error) => {
                let _ = self.finish_earlier_work();
                return Err(error);
            }
        }
        Ok(())
    }

    /// Puts the files of snapshots in order after a commit; what the disk refuses is made good by the next call.
    fn finish_snapshot_commit(&mut self) {
        if let Err(error) = self.finish_commit() {
            log::warn!("{}: committed, but not tidied up: {error:#}", self.folder().display());
        }
    }

    /// Every kept table that a snapshot sees; where one cannot be read, every kept table.
    pub fn seen_by_snapshots(&self) -> impl Iterator<Item = (TileIndex, u64)> {
        let pinned = self.kept.snapshots().pinned().iter();
        pinned.flat_map(|(&tile, flushes)| flushes.iter().map(move |&flush_number| (tile, flush_number)))
    }

    fn write_next_snapshot(
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
        let next = self.layout().snapshot_next();
        CommitLog::write_whole(&**self.disk(), &next, map_id, commits, &metadata.to_text())
            .map_err(|error| Error::io(&next, "write", error))?;
        Ok(())
    }

    /// Deletes a snapshot, and the tables that no other one sees. One that is damaged, cannot be read or is missing can
    /// be deleted too: from then on nothing is kept for it. One whose deletion was interrupted after its commit is gone
    /// since the map was opened: that is no error.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] if there is none of this name; a disk that refuses. Where kept scans that nothing
    /// needs could not be removed, as the disk refused or a catalog is damaged, the snapshot is deleted all the same, and
    /// another call tries again to remove them.
    pub fn delete_snapshot(&mut self, name: &SnapshotName) -> Result<()> {
        self.finish_earlier_work()?;
        let path = self.layout().snapshot(name);
        let is_listed = self.committer.snapshots().is_some_and(|listed| listed.contains(name));
        match self.disk().kind(&path) {
            Ok(Some(EntryKind::File(_))) => {}
            Ok(Some(_)) if Snapshot::has_folder(&**self.disk(), self.layout()).is_ok() => {
                let reason = "no regular file; `voxtile repair` moves it out of the map";
                return Err(FormatError::at_offset(0, reason).in_map(&path, None));
            }
            _ if is_listed => {}
            // By an attempt that was killed after its commit.
            Ok(_) if self.snapshots_removed.contains(name) => return Ok(()),
            // Says which ones there are.
            Ok(_) => return self.snapshot(name).map(drop),
            Err(error) => return Err(Error::io(&path, "look at", error)),
        }
        let mut listed = self.committer.snapshots().cloned().unwrap_or_default();
        listed.remove(name);
        if self.map_id().is_some() {
            self.commit_snapshots(listed)?;
        }
        self.finish_snapshot_commit();
        // As long as the file is there, the same command completes a deletion that was killed or refused.
        if let Err(error) = self.release_unseen_tables() {
            log::warn!("deleted, but its tables stay until the map is opened again: {error:#}");
        }
        self.release_scans().map_err(|error| scans_remain(error, name))?;
        self.checkpoint.remove_snapshot(name);
        self.finish_snapshot_commit();
        Ok(())
    }

    /// Takes snapshots off the list whose files are not there any more, and what was kept for them.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn give_up_snapshots(&mut self, names: &[SnapshotName]) -> Result<()> {
        self.finish_earlier_work()?;
        let mut listed = self.committer.snapshots().cloned().unwrap_or_default();
        let mut is_changed = false;
        for name in names {
            is_changed |= listed.remove(name);
        }
        if is_changed {
            self.commit_snapshots(listed)?;
            self.finish_snapshot_commit();
            self.release_unseen()?;
        }
        Ok(())
    }

    /// Looks at the snapshots anew, and removes the kept tables and kept scans that none of them and no reader needs
    /// any more.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn release_unseen(&mut self) -> Result<()> {
        self.release_unseen_tables()?;
        self.remove_unneeded_scans();
        Ok(())
    }

    fn release_unseen_tables(&mut self) -> Result<()> {
        let Some(map_id) = self.map_id() else { return Ok(()) };
        let (listed, pinned) = (self.committer.snapshots(), self.kept.snapshots().pinned());
        let tiles: Vec<_> = pinned.keys().copied().collect();
        let snapshots =
            SeenTables::read_all(&**self.disk(), self.layout(), map_id, self.commits(), listed, pinned)?;
        self.kept.set_snapshots(snapshots);
        self.kept.release(&self.files);
        for tile in tiles.into_iter().filter(|tile| !self.commits().tiles.contains(*tile)) {
            // Of a removed tile: it goes if that was all that was in it.
            let _ = self.disk().remove_folder(&self.layout().tile_folder(tile));
        }
        Ok(())
    }

    /// Puts a table that is kept under another name, and is the one that the log names, in place.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn put_kept_in_place(&mut self, tile: TileIndex, table: &Path) -> Result<()> {
        self.link_next(tile, table)?;
        let layout = self.layout();
        let (next, current) = (layout.next(tile, TileFile::Table), layout.current(tile, TileFile::Table));
        self.disk().sync_file(&next).map_err(|error| Error::io(&next, "sync", error))?;
        self.files.rename(&next, &current)?;
        self.files.sync_folder(&layout.tile_folder(tile))
    }

    /// Makes a table of the tile that is whole under another name its next version: the same file where the file system
    /// has hard links, else a copy.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn link_next(&mut self, tile: TileIndex, table: &Path) -> Result<()> {
        self.finish_earlier_work()?;
        if self.disk().link(table, &self.layout().next(tile, TileFile::Table)).is_ok() {
            return Ok(());
        }
        let mut input = self.disk().open(table).map_err(|error| Error::io(table, "open", error))?;
        self.write_next(tile, TileFile::Table, |out| io::copy(&mut input, out).map(drop)).map(drop)
    }
}

/// The error of a deletion after which kept scans remain that nothing needs, with what to do.
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
