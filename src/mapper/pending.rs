use crate::scan::{PackedUpdates, TileUpdates};
use crate::space::TileIndex;
use crate::store::WaitingFile;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;

/// Updates that wait for tiles that are not in memory, in order and packed: the first of them in a file, if memory was
/// short, the others in memory.
#[derive(Debug, Default)]
pub(super) struct Pending {
    tiles: FxHashMap<TileIndex, Waiting>,
    bytes: usize,
}

#[derive(Debug, Default)]
struct Waiting {
    in_file: InFile,
    packed: PackedUpdates,
}

/// Updates of one tile in its file.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InFile {
    pub(super) file: WaitingFile,
    pub(super) updates: usize,
}

impl Pending {
    /// What a tile takes beside its updates: its place in the table, which may be half empty.
    pub(super) const SLOT_BYTES: usize = 2 * size_of::<(TileIndex, Waiting)>();

    pub(super) fn push(&mut self, tile: TileIndex, updates: &TileUpdates) {
        self.change(tile, |waiting| waiting.packed.push(updates));
    }

    /// Notes that all that waits for a tile in memory is in its file now, and perhaps more.
    pub(super) fn moved_to_file(&mut self, tile: TileIndex, in_file: InFile) {
        self.change(tile, |waiting| *waiting = Waiting { in_file, packed: PackedUpdates::default() });
    }

    fn change(&mut self, tile: TileIndex, change: impl FnOnce(&mut Waiting)) {
        let mut added = 0;
        let waiting = self.tiles.entry(tile).or_insert_with(|| {
            added += Self::SLOT_BYTES;
            Waiting::default()
        });
        let before = waiting.packed.bytes();
        change(waiting);
        self.bytes = self.bytes + added + waiting.packed.bytes() - before;
    }

    /// Whether something waits for a tile.
    pub(super) fn contains(&self, tile: TileIndex) -> bool {
        self.tiles.contains_key(&tile)
    }

    /// What waits for a tile in its file, before what waits in memory.
    pub(super) fn in_file(&self, tile: TileIndex) -> InFile {
        self.tiles.get(&tile).map(|waiting| waiting.in_file).unwrap_or_default()
    }

    /// What waits for a tile in memory.
    pub(super) fn in_memory(&self, tile: TileIndex) -> Option<&PackedUpdates> {
        self.tiles.get(&tile).map(|waiting| &waiting.packed)
    }

    /// Forgets what waited for a tile: it has been applied. Returns what was in its file.
    pub(super) fn applied(&mut self, tile: TileIndex) -> InFile {
        let Some(waiting) = self.tiles.remove(&tile) else { return InFile::default() };
        self.bytes -= Self::SLOT_BYTES + waiting.packed.bytes();
        waiting.in_file
    }

    pub(super) fn tiles(&self) -> impl Iterator<Item = TileIndex> {
        self.tiles.keys().copied()
    }

    pub(super) fn len(&self) -> usize {
        self.tiles.len()
    }

    /// Bytes of memory.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// Bytes in files.
    pub(super) fn file_bytes(&self) -> u64 {
        self.tiles.values().map(|waiting| waiting.in_file.file.bytes).sum()
    }

    /// Number of updates.
    pub(super) fn updates(&self) -> usize {
        self.tiles.values().map(|waiting| waiting.in_file.updates + waiting.packed.len()).sum()
    }

    /// The tiles of which the file has more than so many bytes, and of the others so many that have the longest; the
    /// longest first and the lowest tile of equals.
    pub(super) fn longest_files(&self, bytes: u64, count: usize) -> Vec<TileIndex> {
        let file_bytes = |waiting: &Waiting| waiting.in_file.file.bytes;
        let is_wanted = |waiting: &Waiting| file_bytes(waiting) > if count > 0 { 0 } else { bytes };
        let wanted = self.tiles.iter().filter(|(_, waiting)| is_wanted(waiting));
        let mut longest: Vec<_> =
            wanted.map(|(tile, waiting)| (Reverse(file_bytes(waiting)), *tile)).collect();
        longest.sort_unstable();
        let long = longest.partition_point(|(Reverse(file), _)| *file > bytes);
        longest.truncate(long + count);
        longest.into_iter().map(|(_, tile)| tile).collect()
    }

    /// The tiles by how many bytes of memory wait for them, the most first and the lowest tile of equals, as far as
    /// these make up so many bytes.
    pub(super) fn heaviest(&self, bytes: usize) -> Vec<TileIndex> {
        let mut heaviest: Vec<_> =
            self.tiles.iter().map(|(tile, waiting)| (Reverse(waiting.packed.bytes()), *tile)).collect();
        heaviest.sort_unstable();
        let mut sum = 0;
        let is_wanted = |&(Reverse(waiting), _): &(Reverse<usize>, TileIndex)| {
            let is_wanted = sum < bytes && waiting > 0;
            sum += waiting + Self::SLOT_BYTES;
            is_wanted
        };
        heaviest.into_iter().take_while(is_wanted).map(|(_, tile)| tile).collect()
    }
}
