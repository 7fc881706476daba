//! Snapshots of a [`TileStore`]: made, deleted, and opened like the map itself.

use super::commit_log::{CommitLog, Commits};
use super::disk::{Disk, EntryKind};
use super::layout::Layout;
use super::layout::TileFile;
use super::map_folder;
use super::metadata::Metadata;
use super::snapshot_file::Snapshot;
use super::snapshot_name::SnapshotName;
use super::snapshots::Snapshots;
use super::tile_store::{TileStore, id_from_hex};
use crate::error::{Error, FormatError, Result};
use crate::space::TileIndex;
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
        let snapshot = Snapshot::read(&*disk, &layout, name, map_id)?;
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

    /// The names of the map's snapshots, in order.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn snapshot_names(&self) -> Result<Vec<SnapshotName>> {
        Snapshot::list(&*self.disk, &self.layout)
    }

    /// Reads what a snapshot of this map says.
    ///
    /// # Errors
    ///
    /// As for [`Snapshot::read`].
    pub fn snapshot(&self, name: &SnapshotName) -> Result<Snapshot> {
        Snapshot::read(&*self.disk, &self.layout, name, self.map_id().unwrap_or_default())
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
        if has_folder && self.kind(&path)?.is_some() {
            let hint = "choose another name, or delete that snapshot first";
            return Err(Error::AlreadyExists { path, hint });
        }
        if !has_folder {
            self.disk.create_folder(&folder).map_err(|error| Error::io(&folder, "create", error))?;
        }
        // Perhaps made by an attempt that could not.
        self.sync_folder(self.layout.folder())?;
        self.write_snapshot(&path, map_id, &self.metadata, &self.commits)?;
        // Also if the name cannot be made durable, nor be removed: what may come back must not miss its tables.
        self.snapshots.share(self.commits.tiles.keys().copied());
        let named = self.sync_folder(&folder);
        if named.is_err() {
            let _ = self.disk.remove_file(&path);
        }
        named
    }

    /// Writes what a snapshot says in place of what it said before.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn replace_snapshot(&self, snapshot: &Snapshot) -> Result<()> {
        let Snapshot { name, map_id, metadata, commits, .. } = snapshot;
        self.write_snapshot(&self.layout.snapshot(name), *map_id, metadata, commits)?;
        self.sync_folder(&self.layout.snapshots())
    }

    /// Every kept table that a snapshot sees; where one cannot be read, every kept table.
    pub fn seen_by_snapshots(&self) -> impl Iterator<Item = (TileIndex, u64)> {
        let pinned = self.snapshots.pinned().iter();
        pinned.flat_map(|(&tile, flushes)| flushes.iter().map(move |&flush_number| (tile, flush_number)))
    }

    fn write_snapshot(
        &self,
        path: &Path,
        map_id: [u8; 16],
        metadata: &Metadata,
        commits: &Commits,
    ) -> Result<()> {
        let metadata = metadata.as_of(commits);
        let next = self.layout.snapshot_next();
        let write = || {
            CommitLog::write_whole(&*self.disk, &next, map_id, commits, &metadata.to_text())?;
            self.disk.rename(&next, path)
        };
        write().map_err(|error| Error::io(path, "write", error))
    }

    /// Deletes a snapshot, and the tables that no other one sees. A damaged one can be deleted too.
    ///
    /// # Errors
    ///
    /// [`Error::InvalidArgument`] if there is none of this name; a disk that refuses.
    pub fn delete_snapshot(&mut self, name: &SnapshotName) -> Result<()> {
        self.settle()?;
        Snapshot::has_folder(&*self.disk, &self.layout)?;
        let path = self.layout.snapshot(name);
        match self.kind(&path)? {
            Some(EntryKind::File(_)) => {}
            Some(_) => return Err(FormatError::at_offset(0, "no regular file").in_map(&path, None)),
            // Says which ones there are.
            None => return self.snapshot(name).map(drop),
        }
        self.disk.remove_file(&path).map_err(|error| Error::io(&path, "remove", error))?;
        // Before the tables: a snapshot that came back would miss them.
        self.sync_folder(&self.layout.snapshots())?;
        if let Err(error) = self.release_unseen() {
            log::warn!("deleted, but its tables stay until the map is opened again: {error}");
        }
        Ok(())
    }

    /// Removes the kept tables that no snapshot and no reader sees any more.
    fn release_unseen(&mut self) -> Result<()> {
        let Some(map_id) = self.map_id() else { return Ok(()) };
        let snapshots = Snapshots::look(&*self.disk, &self.layout, map_id, self.snapshots.pinned())?;
        let before = std::mem::replace(&mut self.snapshots, snapshots);
        for (&tile, flushes) in before.pinned() {
            for &flush_number in flushes.iter().filter(|&&n| !self.snapshots.sees_kept(tile, n)) {
                self.readers.keep(tile, flush_number);
            }
        }
        self.readers.release(&*self.disk, &self.layout);
        for tile in before.pinned().keys().filter(|&tile| !self.commits.tiles.contains_key(tile)) {
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
