use super::readers::Readers;
use super::seen_tables::SeenTables;
use crate::space::TileIndex;
use crate::store::disk::{Disk, ReaderWatch};
use crate::store::map_files::MapFiles;

/// Which replaced tables stay on disk, and for whom: readers beside the writer, and snapshots.
#[derive(Debug, Default)]
pub(in crate::store) struct KeptTables {
    readers: Readers,
    snapshots: SeenTables,
}

impl KeptTables {
    /// Looks which readers are still there.
    pub(in crate::store) fn refresh_readers(&mut self) {
        self.readers.look();
    }

    /// Whether anybody reads the map beside its writer.
    pub(in crate::store) fn has_readers(&self) -> bool {
        self.readers.are_there()
    }

    /// Records that a flush adds a tile: a reader of an earlier flush does not see it.
    pub(in crate::store) fn note_added(&mut self, tile: TileIndex, flush_number: u64) {
        self.readers.note_added(tile, flush_number);
    }

    /// Records that `metadata.json` could not be replaced after a flush: its readers may see that flush.
    pub(in crate::store) fn may_see(&mut self, flush_number: u64) {
        self.readers.may_see(flush_number);
    }

    /// What the snapshots see.
    pub(in crate::store) fn snapshots(&self) -> &SeenTables {
        &self.snapshots
    }

    /// Replaces what the snapshots see. What none of them sees any more stays for readers.
    pub(in crate::store) fn set_snapshots(&mut self, snapshots: SeenTables) {
        let before = std::mem::replace(&mut self.snapshots, snapshots);
        for (&tile, flushes) in before.pinned() {
            for &flush_number in flushes.iter().filter(|&&n| !self.snapshots.sees_kept(tile, n)) {
                self.readers.keep(tile, flush_number);
            }
        }
    }

    /// Notes that there is a snapshot of the map as it is.
    pub(in crate::store) fn share(&mut self, tiles: impl Iterator<Item = TileIndex>) {
        self.snapshots.share(tiles);
    }

    /// Watches over the `metadata.json` that a flush has written.
    pub(in crate::store) fn watch(&mut self, flush_number: u64, metadata: Box<dyn ReaderWatch>) {
        self.readers.watch(flush_number, metadata);
    }

    /// Whether somebody sees the table in place that was the last version as of a flush, and it is not kept yet.
    pub(in crate::store) fn needs(&self, tile: TileIndex, flush_number: u64) -> bool {
        let is_seen =
            self.snapshots.sees_present(tile) || self.readers.see(tile, flush_number, &self.snapshots);
        is_seen && !self.is_pinned(tile, flush_number)
    }

    /// Notes that the table in place was renamed to its kept name as of a flush.
    pub(in crate::store) fn keep(&mut self, tile: TileIndex, flush_number: u64) {
        match self.snapshots.sees_present(tile) {
            true => self.snapshots.pin(tile, flush_number),
            false => self.readers.keep(tile, flush_number),
        }
    }

    /// Whether a snapshot sees the table that was kept as of a flush.
    pub(in crate::store) fn is_pinned(&self, tile: TileIndex, flush_number: u64) -> bool {
        self.snapshots.sees_kept(tile, flush_number)
    }

    /// Notes that the kept table of a tile is durable: no snapshot sees what takes its place.
    pub(in crate::store) fn is_durable(&mut self, tile: TileIndex) {
        self.snapshots.unshare(tile);
    }

    /// Removes the tables that nobody sees any more.
    pub(in crate::store) fn release(&mut self, files: &MapFiles) {
        let disk: &dyn Disk = &**files.disk();
        self.readers.release(disk, files.layout(), &self.snapshots);
    }

    /// Bytes of memory, about.
    pub(in crate::store) fn bytes(&self) -> usize {
        self.snapshots.bytes() + self.readers.bytes()
    }
}
