use super::readers::Readers;
use super::seen_tables::SeenTables;
use crate::space::TileIndex;
use crate::store::disk::{Disk, ReaderWatch};
use crate::store::map_files::MapFiles;

/// Replaced tables that are kept on disk for readers and for snapshots.
#[derive(Debug, Default)]
pub(in crate::store) struct KeptTables {
    readers: Readers,
    snapshots: SeenTables,
}

impl KeptTables {
    /// Updates the list of active readers.
    pub(in crate::store) fn refresh_readers(&mut self) {
        self.readers.look();
    }

    pub(in crate::store) fn has_readers(&self) -> bool {
        self.readers.are_there()
    }

    /// Records that a flush adds a tile, which readers of earlier flushes do not use.
    pub(in crate::store) fn note_added(&mut self, tile: TileIndex, flush_number: u64) {
        self.readers.note_added(tile, flush_number);
    }

    /// Records that `metadata.json` could not be replaced after a flush, so that its readers may use that flush.
    pub(in crate::store) fn may_see(&mut self, flush_number: u64) {
        self.readers.may_see(flush_number);
    }

    pub(in crate::store) fn snapshots(&self) -> &SeenTables {
        &self.snapshots
    }

    /// Replaces the list of tables that snapshots use. Tables that no snapshot uses any more are kept for readers.
    pub(in crate::store) fn set_snapshots(&mut self, snapshots: SeenTables) {
        let before = std::mem::replace(&mut self.snapshots, snapshots);
        for (&tile, flushes) in before.pinned() {
            for &flush_number in flushes.iter().filter(|&&n| !self.snapshots.sees_kept(tile, n)) {
                self.readers.keep(tile, flush_number);
            }
        }
    }

    /// Records a snapshot of the current map.
    pub(in crate::store) fn share(&mut self, tiles: impl Iterator<Item = TileIndex>) {
        self.snapshots.share(tiles);
    }

    /// Watches for readers of the `metadata.json` that a flush has written.
    pub(in crate::store) fn watch(&mut self, flush_number: u64, metadata: Box<dyn ReaderWatch>) {
        self.readers.watch(flush_number, metadata);
    }

    /// Returns whether a reader or a snapshot uses the current table, the last version as of a flush, and it is not
    /// kept yet.
    pub(in crate::store) fn needs(&self, tile: TileIndex, flush_number: u64) -> bool {
        let is_seen =
            self.snapshots.sees_present(tile) || self.readers.see(tile, flush_number, &self.snapshots);
        is_seen && !self.is_pinned(tile, flush_number)
    }

    /// Records that the current table was renamed to its kept name as of a flush.
    pub(in crate::store) fn keep(&mut self, tile: TileIndex, flush_number: u64) {
        match self.snapshots.sees_present(tile) {
            true => self.snapshots.pin(tile, flush_number),
            false => self.readers.keep(tile, flush_number),
        }
    }

    /// Returns whether a snapshot uses the table that was kept as of a flush.
    pub(in crate::store) fn is_pinned(&self, tile: TileIndex, flush_number: u64) -> bool {
        self.snapshots.sees_kept(tile, flush_number)
    }

    /// Records that the kept table of a tile is durable. No snapshot uses the table that replaces it.
    pub(in crate::store) fn is_durable(&mut self, tile: TileIndex) {
        self.snapshots.unshare(tile);
    }

    /// Removes the tables that no reader or snapshot uses any more.
    pub(in crate::store) fn release(&mut self, files: &MapFiles) {
        let disk: &dyn Disk = &**files.disk();
        self.readers.release(disk, files.layout(), &self.snapshots);
    }

    pub(in crate::store) fn bytes(&self) -> usize {
        self.snapshots.bytes() + self.readers.bytes()
    }
}
