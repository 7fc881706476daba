use super::buffered_updates::{BufferedUpdates, Spilled};
use super::tile_disk::TileDisk;
use crate::mapper::statistics::MapStatistics;
use crate::scan::{PackedUpdates, TileUpdates};
use crate::space::{TileIndex, TileTable, hash_table_bytes};
use crate::store::SpillFile;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Updates of tiles that are not resident, until these are loaded. They are in memory, or spilled to files if memory is
/// short. Parts of the scan that is being inserted are staged in files until it is accepted.
#[derive(Debug, Default)]
pub(super) struct WriteBuffer {
    buffered: BufferedUpdates,
    /// Spill files with parts of the scan that is being inserted. They become valid when it is accepted.
    staged: TileTable<Spilled>,
    /// Tiles that a background flush builds from their updates as of its scan. These updates remain here until the tile
    /// is written; later updates follow them.
    frozen: FxHashMap<TileIndex, Frozen>,
}

/// Number of a tile's updates that a flush applies: all in its spill file, and the first ones in memory.
#[derive(Clone, Copy, Debug)]
struct Frozen {
    has_file: bool,
    bytes: usize,
    updates: usize,
    /// Whether the mapper has loaded the tile with these updates, so that they are no longer in the buffer.
    is_forgotten: bool,
}

/// Updates of a tile, in order: those in its spill file, then those in memory.
pub(super) type UpdatesOfTile = (SpillFile, Option<Arc<PackedUpdates>>);

impl WriteBuffer {
    /// Approximate bytes of memory for a tile with a spill file.
    pub(super) const BYTES_OF_FILE: usize = BufferedUpdates::BYTES_OF_FILE;

    pub(super) fn push(&mut self, tile: TileIndex, updates: &TileUpdates) {
        self.buffered.push(tile, updates);
    }

    pub(super) fn contains(&self, tile: TileIndex) -> bool {
        self.buffered.contains(tile)
    }

    pub(super) fn tiles(&self) -> impl Iterator<Item = TileIndex> {
        self.buffered.tiles()
    }

    pub(super) fn bytes(&self) -> usize {
        self.buffered.bytes() + hash_table_bytes::<(TileIndex, Frozen)>(self.frozen.capacity())
    }

    pub(super) fn spill_files(&self) -> usize {
        self.buffered.files()
    }

    /// Bytes of a tile's updates, in memory and in its spill file.
    pub(super) fn bytes_of(&self, tile: TileIndex) -> u64 {
        let in_memory = self.buffered.in_memory(tile).map_or(0, |updates| updates.as_bytes().len());
        self.buffered.spilled(tile).file.bytes + in_memory as u64
    }

    /// Number of a tile's updates, in memory and in its spill file.
    pub(super) fn updates_of(&self, tile: TileIndex) -> u64 {
        let in_memory = self.buffered.in_memory(tile).map_or(0, |updates| updates.len());
        self.buffered.spilled(tile).updates + in_memory as u64
    }

    /// See [`BufferedUpdates::scans`].
    pub(super) fn scans_of(&self, tile: TileIndex) -> u32 {
        self.buffered.scans(tile)
    }

    /// See [`BufferedUpdates::heaviest`].
    pub(super) fn heaviest(&self, bytes: usize) -> Vec<TileIndex> {
        self.buffered.heaviest(bytes)
    }

    /// See [`BufferedUpdates::longest_files`].
    pub(super) fn longest_files(&self, bytes: u64, count: usize) -> Vec<TileIndex> {
        self.buffered.longest_files(bytes, count)
    }

    pub(super) fn of(&self, tile: TileIndex) -> UpdatesOfTile {
        (self.buffered.spilled(tile).file, self.buffered.in_memory(tile).cloned())
    }

    /// Removes a tile's updates, which were applied or are not needed any more.
    pub(super) fn forget(&mut self, index: TileIndex, disk: &TileDisk) {
        let spilled = self.buffered.remove(index);
        match self.frozen.get_mut(&index) {
            // The flush has yet to read the file.
            Some(frozen) => frozen.is_forgotten = true,
            None if spilled.file.bytes > 0 => disk.remove_spill(index),
            None => {}
        }
    }

    // Background flush.

    /// Hands a tile's current updates to a flush, and returns them. Until the flush has written the tile, no updates of
    /// it may be spilled.
    pub(super) fn freeze(&mut self, index: TileIndex) -> UpdatesOfTile {
        let (file, in_memory) = self.of(index);
        let (bytes, updates) =
            in_memory.as_ref().map_or((0, 0), |updates| (updates.as_bytes().len(), updates.len()));
        let frozen = Frozen { has_file: file.bytes > 0, bytes, updates, is_forgotten: false };
        self.frozen.insert(index, frozen);
        (file, in_memory)
    }

    /// Returns whether a flush is going to apply updates of a tile.
    pub(super) fn is_frozen(&self, index: TileIndex) -> bool {
        self.frozen.contains_key(&index)
    }

    /// Records that a flush has processed a tile, and removes the updates that are on disk now. Returns whether the
    /// tile on disk plus the remaining updates is the current tile; otherwise the mapper has loaded the tile since.
    pub(super) fn thaw(&mut self, index: TileIndex, is_on_disk: bool, disk: &TileDisk) -> bool {
        let Some(frozen) = self.frozen.remove(&index) else { return false };
        let is_wanted = !frozen.is_forgotten && !is_on_disk;
        if frozen.has_file && !is_wanted {
            disk.remove_spill(index);
        }
        let is_here = !frozen.is_forgotten && is_on_disk;
        if is_here {
            self.buffered.remove_first(index, frozen.bytes, frozen.updates);
        }
        if self.frozen.is_empty() {
            self.frozen = FxHashMap::default();
        }
        is_here
    }

    /// Records that a tile's updates in memory were moved to its spill file.
    pub(super) fn note_spilled(&mut self, index: TileIndex, file: SpillFile) {
        let in_memory = self.buffered.in_memory(index).map_or(0, |updates| updates.len() as u64);
        let updates = self.buffered.spilled(index).updates + in_memory;
        self.buffered.note_spilled(index, Spilled { file, updates });
    }

    /// The spill file of a tile without updates in memory, including its staged part.
    pub(super) fn staged_file(&self, index: TileIndex) -> SpillFile {
        self.staged_of(index).file
    }

    fn staged_of(&self, index: TileIndex) -> Spilled {
        self.staged.get(index).unwrap_or_else(|| self.buffered.spilled(index))
    }

    /// Records that a part of a scan not yet accepted was appended to a tile's spill file.
    pub(super) fn stage(&mut self, index: TileIndex, file: SpillFile, updates: usize) {
        let updates = self.staged_of(index).updates + updates as u64;
        self.staged.insert(index, Spilled { file, updates });
    }

    /// Returns whether parts of the scan that is being inserted are staged for a tile.
    pub(super) fn is_staged(&self, tile: TileIndex) -> bool {
        self.staged.contains(tile)
    }

    pub(super) fn staged_tiles(&self) -> impl Iterator<Item = TileIndex> {
        self.staged.tiles()
    }

    /// Makes the staged parts valid when their scan is accepted.
    pub(super) fn accept_staged(&mut self) {
        for (index, spilled) in std::mem::take(&mut self.staged).iter() {
            self.buffered.note_spilled(index, spilled);
        }
    }

    /// Truncates the staged parts from the files, because their scan was not accepted and the next flush may need the
    /// space.
    pub(super) fn discard_staged(&mut self, disk: &TileDisk) {
        for index in std::mem::take(&mut self.staged).tiles() {
            disk.cut_spill(index, self.buffered.spilled(index).file);
        }
    }

    pub(super) fn count_into(&self, statistics: &mut MapStatistics) {
        statistics.buffered_tiles = self.buffered.len() as u64;
        statistics.buffered_updates = self.buffered.updates();
        statistics.buffered_bytes = self.buffered.bytes() as u64;
        statistics.spilled_bytes = self.buffered.file_bytes();
    }
}
