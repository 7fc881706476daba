use crate::scan::{PackedUpdates, TileUpdates};
use crate::space::{TileIndex, TileTable, TileValue, put_number, take_number};
use crate::store::SpillFile;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::hash_map::Entry;
use std::sync::Arc;

/// Updates of tiles that are not resident, in order and packed: the first of a tile's spilled to its file, if memory
/// was short, the others in memory.
#[derive(Debug, Default)]
pub(super) struct BufferedUpdates {
    in_memory: FxHashMap<TileIndex, InMemory>,
    /// Bytes of memory of these.
    bytes: usize,
    spilled: TileTable<Spilled>,
    /// The sum of these.
    all_spilled: Spilled,
}

/// Updates of one tile in memory.
#[derive(Debug, Default)]
struct InMemory {
    updates: Arc<PackedUpdates>,
    /// How many scans they are of.
    scans: u32,
}

/// Updates of one tile in its spill file.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spilled {
    pub(super) file: SpillFile,
    pub(super) updates: u64,
}

impl BufferedUpdates {
    /// What a tile takes in memory beside its updates: its place in the table, which may be half empty.
    const SLOT_BYTES: usize = 2 * size_of::<(TileIndex, InMemory)>() + size_of::<PackedUpdates>() + 16;
    /// Bytes of memory that a tile with a spill file takes, about.
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

    /// Notes that a tile's updates in memory are in its spill file now, and perhaps more.
    pub(super) fn note_spilled(&mut self, tile: TileIndex, spilled: Spilled) {
        self.forget_in_memory(tile);
        self.forget_spilled(tile);
        self.all_spilled.file.bytes += spilled.file.bytes;
        self.all_spilled.updates += spilled.updates;
        self.spilled.insert(tile, spilled);
    }

    /// Whether a tile has updates here.
    pub(super) fn contains(&self, tile: TileIndex) -> bool {
        self.in_memory.contains_key(&tile) || self.spilled.contains(tile)
    }

    /// A tile's updates in its spill file, which come before those in memory.
    pub(super) fn spilled(&self, tile: TileIndex) -> Spilled {
        self.spilled.get(tile).unwrap_or_default()
    }

    /// A tile's updates in memory.
    pub(super) fn in_memory(&self, tile: TileIndex) -> Option<&Arc<PackedUpdates>> {
        self.in_memory.get(&tile).map(|in_memory| &in_memory.updates)
    }

    /// How many scans a tile's updates in memory are of.
    pub(super) fn scans(&self, tile: TileIndex) -> u32 {
        self.in_memory.get(&tile).map_or(0, |in_memory| in_memory.scans)
    }

    /// Forgets a tile's updates. Returns what was in its spill file.
    pub(super) fn remove(&mut self, tile: TileIndex) -> Spilled {
        self.forget_in_memory(tile);
        self.forget_spilled(tile)
    }

    /// Forgets the first of a tile's updates: those in its spill file, and so many bytes of those in memory, which hold
    /// so many updates.
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

    /// Bytes of memory.
    pub(super) fn bytes(&self) -> usize {
        self.bytes + self.spilled.bytes()
    }

    /// Number of tiles with a spill file.
    pub(super) fn files(&self) -> usize {
        self.spilled.len()
    }

    /// Bytes in files.
    pub(super) fn file_bytes(&self) -> u64 {
        self.all_spilled.file.bytes
    }

    /// Number of updates.
    pub(super) fn updates(&self) -> u64 {
        let in_memory: usize = self.in_memory.values().map(|in_memory| in_memory.updates.len()).sum();
        self.all_spilled.updates + in_memory as u64
    }

    /// The tiles with a spill file of more than so many bytes, and `count` others with the longest files. The longest
    /// comes first; of equals, the lowest tile.
    pub(super) fn longest_files(&self, bytes: u64, count: usize) -> Vec<TileIndex> {
        let files = self.spilled.iter().map(|(tile, spilled)| (Reverse(spilled.file.bytes), tile));
        let least = if count > 0 { 0 } else { bytes };
        let mut longest: Vec<_> = files.filter(|(Reverse(file), _)| *file > least).collect();
        longest.sort_unstable();
        let long = longest.partition_point(|(Reverse(file), _)| *file > bytes);
        longest.truncate(long + count);
        longest.into_iter().map(|(_, tile)| tile).collect()
    }

    /// The tiles whose updates take the most memory, as many as make up so many bytes. The heaviest comes first; of
    /// equals, the lowest tile.
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
