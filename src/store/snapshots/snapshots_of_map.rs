//! Snapshots of a map: opened like the map itself, listed and read.

use super::snapshot_file::Snapshot;
use super::snapshot_list::SnapshotList;
use super::snapshot_name::SnapshotName;
use super::snapshot_writer::SnapshotWriter;
use crate::error::{Error, Result};
use crate::space::TileIndex;
use crate::store::commit::commit_log::CommitLog;
use crate::store::disk::Disk;
use crate::store::layout::Layout;
use crate::store::map_folder;
use crate::store::scans::{KeptRecords, kept_as_of, whole_fronts};
use crate::store::tile_store::{TileStore, id_from_hex};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Snapshots of a map, for reading.
#[derive(Clone, Copy, Debug)]
pub struct Snapshots<'a> {
    store: &'a TileStore,
}

impl TileStore {
    /// Returns the snapshots of the map.
    pub fn snapshots(&self) -> Snapshots<'_> {
        Snapshots { store: self }
    }

    /// Returns a writer of snapshots.
    pub fn snapshot_writer(&mut self) -> SnapshotWriter<'_> {
        SnapshotWriter { store: self }
    }

    /// Opens a snapshot for reading, without a lock and without writing. A writer may be active.
    ///
    /// # Errors
    ///
    /// No map, no snapshot of this name, damage, or an I/O error.
    pub fn open_snapshot(disk: Arc<dyn Disk>, folder: &Path, name: &SnapshotName) -> Result<Self> {
        let layout = Layout::new(folder);
        let metadata = map_folder::read_metadata(&*disk, &layout)?;
        let Some(map_id) = metadata.ext.as_ref().and_then(|ext| id_from_hex(&ext.map_id)) else {
            let map = folder.display();
            let reason =
                format!("{map} has no snapshot {name}: maps of the original format have no snapshots");
            return Err(Error::argument("snapshot", reason));
        };
        // The log may be newer than `metadata.json`. If it is unreadable, use `metadata.json`.
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

    /// Returns the map as of one of its snapshots, for reading.
    pub fn at(&self, snapshot: &Snapshot) -> Self {
        Self::of_snapshot(self.disk().clone(), self.layout().clone(), snapshot.clone())
    }

    /// Opened snapshot; `None` for the current map.
    pub fn opened_snapshot(&self) -> Option<&SnapshotName> {
        self.opened_snapshot.as_ref()
    }

    /// Returns whether the last commit equals `past`, a snapshot of this map: the same tiles, scans, parameters and
    /// inputs. Flush numbers may differ, because creating and deleting snapshots are flushes.
    ///
    /// # Errors
    ///
    /// A damaged list of scans or an I/O error.
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

    /// Commits a new list of snapshots and nothing else. Written tiles remain uncommitted. This is a flush of its own
    /// in the log, so that recovery handles a crash like at any other flush.
    pub(in crate::store) fn commit_snapshots(&mut self, listed: SnapshotList) -> Result<()> {
        self.committer.check_lock()?;
        self.remove_excess_scans()?;
        self.name_own_catalog();
        self.keep_for_late_readers();
        match self.committer.append_snapshots(&self.files, &self.versions, listed) {
            Ok(number) => self.committed_nothing(number),
            Err(error) => {
                let _ = self.finish_earlier_work();
                return Err(error);
            }
        }
        Ok(())
    }
}

impl<'a> Snapshots<'a> {
    /// Returns the names of the map's snapshots, in order, including those without a file.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn names(self) -> Result<Vec<SnapshotName>> {
        match self.store.committer.snapshots() {
            Some(listed) => Ok(listed.names().cloned().collect()),
            None => Snapshot::list(&**self.store.disk(), self.store.layout()),
        }
    }

    /// List of snapshots in the log; `None` if the log has none.
    pub fn list(self) -> Option<&'a SnapshotList> {
        self.store.committer.snapshots()
    }

    /// Reads a snapshot of this map.
    ///
    /// # Errors
    ///
    /// As for [`Snapshot::read`].
    pub fn read(self, name: &SnapshotName) -> Result<Snapshot> {
        let map_id = self.store.committer.logged_map_id()?;
        Snapshot::read(
            &**self.store.disk(),
            self.store.layout(),
            name,
            map_id,
            self.store.committer.snapshots(),
        )
    }

    /// Reads all snapshots of the map.
    ///
    /// # Errors
    ///
    /// As for [`Snapshot::read`].
    pub fn read_all(self) -> Result<Vec<Snapshot>> {
        if self.store.map_id().is_none() {
            return Ok(Vec::new());
        }
        self.names()?.iter().map(|name| self.read(name)).collect()
    }

    /// Returns the kept tables that snapshots use. An unreadable snapshot uses all.
    pub fn kept_tables(self) -> impl Iterator<Item = (TileIndex, u64)> + use<'a> {
        let pinned = self.store.kept.snapshots().pinned().iter();
        pinned.flat_map(|(&tile, flushes)| flushes.iter().map(move |&flush_number| (tile, flush_number)))
    }

    /// Returns the catalogs and segments that neither the last commit nor a snapshot needs, in order. A killed writer
    /// did not remove them, or an active one has not committed them yet. Returns `None` if a snapshot is unreadable,
    /// because it may need any of them.
    ///
    /// # Errors
    ///
    /// An I/O error, or an unreadable catalog, which may need any of them.
    pub(crate) fn idle_scan_files(self) -> Result<Option<Vec<PathBuf>>> {
        match self.read_all() {
            Ok(snapshots) => {
                let flushes = snapshots.iter().filter_map(kept_as_of).collect();
                self.store.unneeded_scans(flushes, |_| false).map(|(files, _)| Some(files))
            }
            Err(Error::Damaged { .. }) => Ok(None),
            Err(error) if error.is_of_medium() => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Checks the catalogs of the snapshots before points are removed from the map: a damaged catalog would hide which
    /// files are needed. A snapshot whose own file is damaged is skipped, and keeps all files.
    ///
    /// # Errors
    ///
    /// A damaged or missing catalog, with the remedy, or an I/O error.
    pub(crate) fn check_catalogs(self) -> Result<()> {
        let (disk, layout) = (&**self.store.disk(), self.store.layout());
        let mut needed = Vec::new();
        for name in self.names()? {
            match self.read(&name) {
                Ok(snapshot) => needed.extend(kept_as_of(&snapshot).map(|as_of| (name, as_of))),
                Err(Error::Damaged { .. }) => {}
                Err(error) if error.is_of_medium() => {}
                Err(error) => return Err(error),
            }
        }
        // Longest first among versions of one catalog: for the shorter ones the checksum suffices.
        needed.sort_by_key(|(_, as_of)| std::cmp::Reverse(as_of.catalog));
        for of_one in needed.chunk_by(|(_, a), (_, b)| {
            a.catalog.map(|catalog| catalog.generation) == b.catalog.map(|catalog| catalog.generation)
        }) {
            let fronts: Vec<_> = of_one.iter().filter_map(|(_, as_of)| as_of.catalog).collect();
            let (are_whole, mut is_read) = (whole_fronts(disk, layout, &fronts), false);
            for (at, (name, as_of)) in of_one.iter().enumerate() {
                if is_read && are_whole.get(at).copied().unwrap_or(false) {
                    continue;
                }
                let read = || -> Result<()> {
                    let mut records = KeptRecords::open(disk, layout, *as_of)?;
                    while records.next_entry()?.is_some() {}
                    Ok(())
                };
                read().map_err(|error| needed_by(error, name))?;
                is_read = true;
            }
        }
        Ok(())
    }
}

/// Returns the error of a catalog that a snapshot needs, with the remedy.
fn needed_by(error: Error, name: &SnapshotName) -> Error {
    let Error::Damaged { path, tile, mut cause } = error else { return error };
    cause.reason.push_str(&format!(
        "; the snapshot {name} needs it; nothing was changed; repair the map or delete the snapshot, and run this again"
    ));
    Error::Damaged { path, tile, cause }
}
