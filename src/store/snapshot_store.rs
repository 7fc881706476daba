//! Snapshots of a [`TileStore`]: made, deleted, and opened like the map itself.

use super::commit_log::{CommitLog, Commits};
use super::commit_record::Flush;
use super::disk::{Disk, EntryKind};
use super::layout::Layout;
use super::layout::TileFile;
use super::map_folder;
use super::metadata::Metadata;
use super::snapshot_file::Snapshot;
use super::snapshot_list::{MOST_SNAPSHOTS, SnapshotList};
use super::snapshot_name::SnapshotName;
use super::snapshots::Snapshots;
use super::tile_store::{TileStore, id_from_hex};
use crate::error::{Error, FormatError, Result};
use crate::space::{TileIndex, TileTable};
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
                format!("{map} has none with the name {name}: a map of the seed's format has no snapshots");
            return Err(Error::argument("snapshot", reason));
        };
        // The log may be ahead of the file; where it cannot be read, the file is what there is.
        let listed = match Self::read(disk.clone(), layout.clone(), metadata.clone()) {
            Ok(store) => store.listed,
            Err(_) => metadata.ext.and_then(|ext| ext.snapshots),
        };
        let snapshot = Snapshot::read(&*disk, &layout, name, map_id, listed.as_ref())?;
        Ok(Self::of_snapshot(disk, layout, snapshot))
    }

    fn of_snapshot(disk: Arc<dyn Disk>, layout: Layout, snapshot: Snapshot) -> Self {
        let Snapshot { name, map_id, metadata, commits, .. } = snapshot;
        let mut store = Self::new(disk, layout, metadata, Some(CommitLog::of_map(map_id)), commits);
        store.snapshot = Some(name);
        store
    }

    /// The map as a snapshot of it says, for reading.
    pub fn at(&self, snapshot: &Snapshot) -> Self {
        Self::of_snapshot(self.disk.clone(), self.layout.clone(), snapshot.clone())
    }

    /// The snapshot that this store was opened as.
    pub fn opened_snapshot(&self) -> Option<&SnapshotName> {
        self.snapshot.as_ref()
    }

    /// The names of the map's snapshots, in order, also of those whose file is missing.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn snapshot_names(&self) -> Result<Vec<SnapshotName>> {
        match &self.listed {
            Some(listed) => Ok(listed.names().cloned().collect()),
            None => Snapshot::list(&*self.disk, &self.layout),
        }
    }

    /// Which snapshots the map has, as its log says; `None` if it does not.
    pub fn snapshot_list(&self) -> Option<&SnapshotList> {
        self.listed.as_ref()
    }

    /// Reads what a snapshot of this map says.
    ///
    /// # Errors
    ///
    /// As for [`Snapshot::read`].
    pub fn snapshot(&self, name: &SnapshotName) -> Result<Snapshot> {
        let map_id = self.map_id().unwrap_or_default();
        Snapshot::read(&*self.disk, &self.layout, name, map_id, self.listed.as_ref())
    }

    /// Keeps the last commit under a name, until the snapshot is deleted: from here on its tables stay when they are
    /// replaced. What is written and not committed is no part of it. When this returns it is durable; after an error there
    /// is none.
    ///
    /// # Errors
    ///
    /// [`Error::AlreadyExists`] if there is one of this name; a map of the seed's format, which must be adopted first; a
    /// disk that refuses.
    pub fn create_snapshot(&mut self, name: &SnapshotName) -> Result<()> {
        self.settle()?;
        let Some(map_id) = self.map_id() else {
            return Err(Error::argument("map", "a map of the seed's format must be adopted first"));
        };
        let (folder, path) = (self.layout.snapshots(), self.layout.snapshot(name));
        let has_folder = Snapshot::has_folder(&*self.disk, &self.layout)?;
        let mut listed = self.listed.clone().unwrap_or_default();
        if listed.contains(name) || has_folder && self.kind(&path)?.is_some() {
            let hint = "choose another name, or delete that snapshot first";
            return Err(Error::AlreadyExists { path, hint });
        }
        if listed.len() >= MOST_SNAPSHOTS {
            let (size, limit) = (listed.len() as u64 + 1, MOST_SNAPSHOTS as u64);
            let hint = "delete some first";
            return Err(Error::TooLarge { what: "the number of snapshots", size, limit, hint });
        }
        if !has_folder {
            self.disk.create_folder(&folder).map_err(|error| Error::io(&folder, "create", error))?;
        }
        // Perhaps made by an attempt that could not.
        self.sync_folder(self.layout.folder())?;
        let next = self.layout.snapshot_next();
        let flush_number = self.commits.flush_number;
        self.write_next_snapshot(name, map_id, &self.metadata, &self.commits)?;
        self.sync_folder(&folder)?;
        listed.insert(name.clone(), Some(flush_number));
        if let Err(error) = self.commit_snapshots(listed) {
            // Also if it stays, nothing names it.
            let _ = self.disk.remove_file(&next);
            return Err(error);
        }
        // Committed.
        self.snapshots.share(self.commits.tiles.tiles());
        self.unnamed_snapshot = Some(name.clone());
        self.tidy_snapshots();
        Ok(())
    }

    /// Writes what a snapshot says in place of what it said before.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn replace_snapshot(&self, snapshot: &Snapshot) -> Result<()> {
        let Snapshot { name, map_id, metadata, commits, .. } = snapshot;
        let (next, path) = (self.layout.snapshot_next(), self.layout.snapshot(name));
        self.write_next_snapshot(name, *map_id, metadata, commits)?;
        self.disk.rename(&next, &path).map_err(|error| Error::io(&path, "replace", error))?;
        self.sync_folder(&self.layout.snapshots())
    }

    /// Commits which snapshots the map has, and nothing else: what is written of tiles stays uncommitted. It is a flush of its
    /// own in the log, so that whatever ends the process is found like any other.
    fn commit_snapshots(&mut self, listed: SnapshotList) -> Result<()> {
        let Some(mut log) = self.log else {
            return Err(Error::argument("map", "a map of the seed's format must be adopted first"));
        };
        self.check_lock()?;
        self.keep_for_late_readers();
        let before = self.listed.replace(listed);
        let (number, scan_number) = (self.commits.flush_number + 1, self.commits.scan_number);
        let metadata = self.fill_in(self.metadata.clone(), number, scan_number);
        let text = metadata.to_text();
        let flush = Flush {
            number,
            scan_number,
            changed: &TileTable::default(),
            removed: &[],
            metadata_text: Some(&text),
        };
        let log_path = self.layout.commit_log();
        if let Err(error) = log.append(&*self.disk, &log_path, &flush) {
            self.listed = before;
            self.is_log_settled = false;
            let _ = self.settle();
            return Err(Error::io(&log_path, "append to", error));
        }
        (self.log, self.metadata) = (Some(log), metadata);
        self.commits.flush_number = number;
        Ok(())
    }

    /// Puts the files of snapshots in order after a commit; what the disk refuses is made good by the next call.
    fn tidy_snapshots(&mut self) {
        if let Err(error) = self.tidy_up() {
            log::warn!("{}: committed, but not tidied up: {error}", self.folder().display());
        }
    }

    /// Gives a committed snapshot its name, and takes away the file of a deleted one.
    pub(super) fn finish_snapshots(&mut self) -> Result<()> {
        if self.unnamed_snapshot.is_none() && self.deleted_snapshot.is_none() {
            return Ok(());
        }
        if let Some(name) = &self.unnamed_snapshot {
            self.rename(&self.layout.snapshot_next(), &self.layout.snapshot(name))?;
        }
        if let Some(name) = &self.deleted_snapshot {
            let path = self.layout.snapshot(name);
            match self.disk.remove_file(&path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => {
                    return Err(Error::io(&path, "remove", error));
                }
                _ => {}
            }
        }
        self.sync_folder(&self.layout.snapshots())?;
        (self.unnamed_snapshot, self.deleted_snapshot) = (None, None);
        Ok(())
    }

    /// Every kept table that a snapshot sees; where one cannot be read, every kept table.
    pub fn seen_by_snapshots(&self) -> impl Iterator<Item = (TileIndex, u64)> {
        let pinned = self.snapshots.pinned().iter();
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
        let next = self.layout.snapshot_next();
        CommitLog::write_whole(&*self.disk, &next, map_id, commits, &metadata.to_text())
            .map_err(|error| Error::io(&next, "write", error))?;
        Ok(())
    }

    /// Deletes a snapshot, and the tables that no other one sees. One that is damaged, cannot be read or is missing can be
    /// deleted too: from then on nothing is kept for it.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] if there is none of this name; a disk that refuses.
    pub fn delete_snapshot(&mut self, name: &SnapshotName) -> Result<()> {
        self.settle()?;
        let path = self.layout.snapshot(name);
        let is_listed = self.listed.as_ref().is_some_and(|listed| listed.contains(name));
        match self.disk.kind(&path) {
            Ok(Some(EntryKind::File(_))) => {}
            Ok(Some(_)) if Snapshot::has_folder(&*self.disk, &self.layout).is_ok() => {
                let reason = "no regular file; `voxtile repair` moves it out of the map";
                return Err(FormatError::at_offset(0, reason).in_map(&path, None));
            }
            _ if is_listed => {}
            // Says which ones there are.
            Ok(_) => return self.snapshot(name).map(drop),
            Err(error) => return Err(Error::io(&path, "look at", error)),
        }
        let mut listed = self.listed.clone().unwrap_or_default();
        listed.remove(name);
        if self.map_id().is_some() {
            self.commit_snapshots(listed)?;
        }
        self.deleted_snapshot = Some(name.clone());
        self.tidy_snapshots();
        if let Err(error) = self.release_unseen() {
            log::warn!("deleted, but its tables stay until the map is opened again: {error}");
        }
        Ok(())
    }

    /// Takes snapshots off the list whose files are not there any more, and what was kept for them.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn give_up_snapshots(&mut self, names: &[SnapshotName]) -> Result<()> {
        self.settle()?;
        let mut listed = self.listed.clone().unwrap_or_default();
        let mut is_changed = false;
        for name in names {
            is_changed |= listed.remove(name);
        }
        if is_changed {
            self.commit_snapshots(listed)?;
            self.tidy_snapshots();
            self.release_unseen()?;
        }
        Ok(())
    }

    /// Removes the kept tables that no snapshot and no reader sees any more.
    fn release_unseen(&mut self) -> Result<()> {
        let Some(map_id) = self.map_id() else { return Ok(()) };
        let (listed, kept) = (self.listed.as_ref(), self.snapshots.pinned());
        let snapshots = Snapshots::look(&*self.disk, &self.layout, map_id, &self.commits, listed, kept)?;
        let before = std::mem::replace(&mut self.snapshots, snapshots);
        for (&tile, flushes) in before.pinned() {
            for &flush_number in flushes.iter().filter(|&&n| !self.snapshots.sees_kept(tile, n)) {
                self.readers.keep(tile, flush_number);
            }
        }
        self.readers.release(&*self.disk, &self.layout, &self.snapshots);
        for tile in before.pinned().keys().filter(|&tile| !self.commits.tiles.contains(*tile)) {
            // Of a removed tile: it goes if that was all that was in it.
            let _ = self.disk.remove_folder(&self.layout.tile_folder(*tile));
        }
        Ok(())
    }

    /// Makes a table of the tile that is whole under another name its next version: the same file where the file system
    /// has hard links, else a copy.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn link_next(&mut self, tile: TileIndex, table: &Path) -> Result<()> {
        self.settle()?;
        if self.disk.link(table, &self.layout.next(tile, TileFile::Table)).is_ok() {
            return Ok(());
        }
        let mut input = self.disk.open(table).map_err(|error| Error::io(table, "open", error))?;
        self.write_next(tile, TileFile::Table, |out| io::copy(&mut input, out).map(drop)).map(drop)
    }
}
