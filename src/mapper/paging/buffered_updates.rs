use crate::scan::{PackedUpdates, TileUpdates};
use crate::space::{TileIndex, TileTable, TileValue, put_number, take_number};
use crate::store::SpillFile;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::hash_map::Entry;
use std::sync::Arc;

/// Packed updates of tiles that are not resident, in order. If memory is short, the earliest updates of a tile are
/// spilled to its file.
#[derive(Debug, Default)]
pub(super) struct BufferedUpdates {
    in_memory: FxHashMap<TileIndex, InMemory>,
    /// Bytes of memory of the updates in `in_memory`.
    bytes: usize,
    spilled: TileTable<Spilled>,
    /// Sum over `spilled`.
    all_spilled: Spilled,
}

/// Updates of one tile that are in memory.
#[derive(Debug, Default)]
struct InMemory {
    updates: Arc<PackedUpdates>,
    /// Number of scans that these updates come from.
    scans: u32,
}

/// Updates of one tile that are in its spill file.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spilled {
    pub(super) file: SpillFile,
    pub(super) updates: u64,
}

impl BufferedUpdates {
    /// Bytes of memory of a tile in addition to its updates: a slot in a hash table that may be half empty.
    const SLOT_BYTES: usize = 2 * size_of::<(TileIndex, InMemory)>() + size_of::<PackedUpdates>() + 16;
    /// Approximate bytes of memory for a tile with a spill file.
    pub(super) const BYTES_OF_FILE: usize = 24;

    pub(super) fn push(&mut self, tile: TileIndex, updates: &TileUpdates) {
        let so_far = match self.in_memory.entry(tile) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(place) => {
                self.bytes += Self::SLOT_BYTES;
                place.insert(InMemory::default())
            }
        };
        so_far.scans += 1;
        let updates_so_far = Arc::make_mut(&mut so_far.updates);
        self.bytes -= updates_so_far.bytes();
        updates_so_far.push(updates);
        self.bytes += updates_so_far.bytes();
    }

    /// Records that a tile's updates in memory were moved to its spill file.
    pub(super) fn note_spilled(&mut self, tile: TileIndex, spilled: Spilled) {
        self.forget_in_memory(tile);
        self.forget_spilled(tile);
        self.all_spilled.file.bytes += spilled.file.bytes;
        self.all_spilled.updates += spilled.updates;
        self.spilled.insert(tile, spilled);
    }

    /// Returns whether updates of a tile are buffered.
    pub(super) fn contains(&self, tile: TileIndex) -> bool {
        self.in_memory.contains_key(&tile) || self.spilled.contains(tile)
    }

    /// Updates in a tile's spill file. They precede those in memory.
    pub(super) fn spilled(&self, tile: TileIndex) -> Spilled {
        self.spilled.get(tile).unwrap_or_default()
    }

    pub(super) fn in_memory(&self, tile: TileIndex) -> Option<&Arc<PackedUpdates>> {
        self.in_memory.get(&tile).map(|in_memory| &in_memory.updates)
    }

    /// Number of scans that a tile's updates in memory come from.
    pub(super) fn scans(&self, tile: TileIndex) -> u32 {
        self.in_memory.get(&tile).map_or(0, |in_memory| in_memory.scans)
    }

    /// Removes all updates of a tile. Returns those that were in its spill file.
    pub(super) fn remove(&mut self, tile: TileIndex) -> Spilled {
        self.forget_in_memory(tile);
        self.forget_spilled(tile)
    }

    /// Removes the earliest updates of a tile: its spill file, and the first `bytes` bytes (`updates` updates) in
    /// memory.
    pub(super) fn remove_first(&mut self, tile: TileIndex, bytes: usize, updates: usize) {
        self.forget_spilled(tile);
        let Some(in_memory) = self.in_memory.get_mut(&tile) else { return };
        if in_memory.updates.as_bytes().len() <= bytes {
            return self.forget_in_memory(tile);
        }
        self.bytes -= in_memory.updates.bytes();
        let later = Arc::make_mut(&mut in_memory.updates);
        later.drop_first(bytes, updates);
        later.shrink();
        self.bytes += later.bytes();
    }

    fn forget_in_memory(&mut self, tile: TileIndex) {
        if let Some(removed) = self.in_memory.remove(&tile) {
            self.bytes -= Self::SLOT_BYTES + removed.updates.bytes();
        }
    }

    fn forget_spilled(&mut self, tile: TileIndex) -> Spilled {
        let spilled = self.spilled(tile);
        if self.spilled.remove(tile) {
            self.all_spilled.file.bytes -= spilled.file.bytes;
            self.all_spilled.updates -= spilled.updates;
        }
        spilled
    }

    pub(super) fn tiles(&self) -> impl Iterator<Item = TileIndex> {
        let in_memory = self.in_memory.keys().copied();
        self.spilled.tiles().chain(in_memory.filter(|tile| !self.spilled.contains(*tile)))
    }

    pub(super) fn len(&self) -> usize {
        self.tiles().count()
    }

    pub(super) fn bytes(&self) -> usize {
        self.bytes + self.spilled.bytes()
    }

    pub(super) fn files(&self) -> usize {
        self.spilled.len()
    }

    /// Total size of the spill files in bytes.
    pub(super) fn file_bytes(&self) -> u64 {
        self.all_spilled.file.bytes
    }

    /// Number of updates in memory and in files.
    pub(super) fn updates(&self) -> u64 {
        let in_memory: usize = self.in_memory.values().map(|in_memory| in_memory.updates.len()).sum();
        self.all_spilled.updates + in_memory as u64
    }

    /// Returns the tiles whose spill files exceed `bytes`, and the `count` next longest ones, in descending order; ties
    /// are sorted by tile.
    pub(super) fn longest_files(&self, bytes: u64, count: usize) -> Vec<TileIndex> {
        let files = self.spilled.iter().map(|(tile, spilled)| (Reverse(spilled.file.bytes), tile));
        let least = if count > 0 { 0 } else { bytes };
        let mut longest: Vec<_> = files.filter(|(Reverse(file), _)| *file > least).collect();
        longest.sort_unstable();
        let long = longest.partition_point(|(Reverse(file), _)| *file > bytes);
        longest.truncate(long + count);
        longest.into_iter().map(|(_, tile)| tile).collect()
    }

    /// Returns the tiles whose updates take the most memory, until their sum reaches `bytes`, in descending order; ties
    /// are sorted by tile.
    pub(super) fn heaviest(&self, bytes: usize) -> Vec<TileIndex> {
        let mut heaviest: Vec<_> =
            self.in_memory.iter().map(|(tile, of)| (Reverse(of.updates.bytes()), *tile)).collect();
        heaviest.sort_unstable();
        let mut sum = 0;
        let is_wanted = |&(Reverse(own_bytes), _): &(Reverse<usize>, TileIndex)| {
            let is_wanted = sum < bytes && own_bytes > 0;
            sum += own_bytes + Self::SLOT_BYTES;
            is_wanted
        };
        heaviest.into_iter().take_while(is_wanted).map(|(_, tile)| tile).collect()
    }
}

impl TileValue for Spilled {
    fn pack(self, _: Self, out: &mut Vec<u8>) {
        self.file.pack(SpillFile::default(), out);
        put_number(self.updates, out);
    }

    fn unpack(_: Self, input: &mut &[u8]) -> Self {
        Self { file: SpillFile::unpack(SpillFile::default(), input), updates: take_number(input) }
    }
}
