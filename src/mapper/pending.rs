use crate::scan::{PackedUpdates, TileUpdates};
use crate::space::{TileIndex, TileTable, TileValue, put_number, take_number};
use crate::store::WaitingFile;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::hash_map::Entry;

/// Updates that wait for tiles that are not in memory, in order and packed: the first of them in a file, if memory was
/// short, the others in memory.
#[derive(Debug, Default)]
pub(super) struct Pending {
    in_memory: FxHashMap<TileIndex, PackedUpdates>,
    /// Bytes of memory of these.
    bytes: usize,
    in_files: TileTable<InFile>,
    /// Their sum.
    all_in_files: InFile,
}

/// Updates of one tile in its file.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InFile {
    pub(super) file: WaitingFile,
    pub(super) updates: u64,
}

impl Pending {
    /// What a tile takes in memory beside its updates: its place in the table, which may be half empty.
    const SLOT_BYTES: usize = 2 * size_of::<(TileIndex, PackedUpdates)>();
    /// About what a tile takes in memory whose updates are in a file.
    pub(super) const BYTES_OF_FILE: usize = 24;

    pub(super) fn push(&mut self, tile: TileIndex, updates: &TileUpdates) {
        let waiting = match self.in_memory.entry(tile) {
            Entry::Occupied(waiting) => waiting.into_mut(),
            Entry::Vacant(place) => {
                self.bytes += Self::SLOT_BYTES;
                place.insert(PackedUpdates::default())
            }
        };
        self.bytes -= waiting.bytes();
        waiting.push(updates);
        self.bytes += waiting.bytes();
    }

    /// Notes that all that waits for a tile in memory is in its file now, and perhaps more.
    pub(super) fn moved_to_file(&mut self, tile: TileIndex, in_file: InFile) {
        self.forget_in_memory(tile);
        self.forget_in_file(tile);
        self.all_in_files.file.bytes += in_file.file.bytes;
        self.all_in_files.updates += in_file.updates;
        self.in_files.insert(tile, in_file);
    }

    /// Whether something waits for a tile.
    pub(super) fn contains(&self, tile: TileIndex) -> bool {
        self.in_memory.contains_key(&tile) || self.in_files.contains(tile)
    }

    /// What waits for a tile in its file, before what waits in memory.
    pub(super) fn in_file(&self, tile: TileIndex) -> InFile {
        self.in_files.get(tile).unwrap_or_default()
    }

    /// What waits for a tile in memory.
    pub(super) fn in_memory(&self, tile: TileIndex) -> Option<&PackedUpdates> {
        self.in_memory.get(&tile)
    }

    /// Forgets what waited for a tile: it has been applied. Returns what was in its file.
    pub(super) fn applied(&mut self, tile: TileIndex) -> InFile {
        self.forget_in_memory(tile);
        self.forget_in_file(tile)
    }

    fn forget_in_memory(&mut self, tile: TileIndex) {
        if let Some(waiting) = self.in_memory.remove(&tile) {
            self.bytes -= Self::SLOT_BYTES + waiting.bytes();
        }
    }

    fn forget_in_file(&mut self, tile: TileIndex) -> InFile {
        let in_file = self.in_file(tile);
        if self.in_files.remove(tile) {
            self.all_in_files.file.bytes -= in_file.file.bytes;
            self.all_in_files.updates -= in_file.updates;
        }
        in_file
    }

    pub(super) fn tiles(&self) -> impl Iterator<Item = TileIndex> {
        let in_memory = self.in_memory.keys().copied();
        self.in_files.tiles().chain(in_memory.filter(|tile| !self.in_files.contains(*tile)))
    }

    pub(super) fn len(&self) -> usize {
        self.tiles().count()
    }

    /// Bytes of memory.
    pub(super) fn bytes(&self) -> usize {
        self.bytes + self.in_files.bytes()
    }

    /// Number of tiles that have a file.
    pub(super) fn files(&self) -> usize {
        self.in_files.len()
    }

    /// Bytes in files.
    pub(super) fn file_bytes(&self) -> u64 {
        self.all_in_files.file.bytes
    }

    /// Number of updates.
    pub(super) fn updates(&self) -> u64 {
        let in_memory: usize = self.in_memory.values().map(PackedUpdates::len).sum();
        self.all_in_files.updates + in_memory as u64
    }

    /// The tiles of which the file has more than so many bytes, and of the others so many that have the longest; the
    /// longest first and the lowest tile of equals.
    pub(super) fn longest_files(&self, bytes: u64, count: usize) -> Vec<TileIndex> {
        let files = self.in_files.iter().map(|(tile, in_file)| (Reverse(in_file.file.bytes), tile));
        let least = if count > 0 { 0 } else { bytes };
        let mut longest: Vec<_> = files.filter(|(Reverse(file), _)| *file > least).collect();
        longest.sort_unstable();
        let long = longest.partition_point(|(Reverse(file), _)| *file > bytes);
        longest.truncate(long + count);
        longest.into_iter().map(|(_, tile)| tile).collect()
    }

    /// The tiles by how many bytes of memory wait for them, the most first and the lowest tile of equals, as far as
    /// these make up so many bytes.
    pub(super) fn heaviest(&self, bytes: usize) -> Vec<TileIndex> {
        let mut heaviest: Vec<_> =
            self.in_memory.iter().map(|(tile, waiting)| (Reverse(waiting.bytes()), *tile)).collect();
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

impl TileValue for InFile {
    fn pack(self, _: Self, out: &mut Vec<u8>) {
        self.file.pack(WaitingFile::default(), out);
        put_number(self.updates, out);
    }

    fn unpack(_: Self, input: &mut &[u8]) -> Self {
        Self { file: WaitingFile::unpack(WaitingFile::default(), input), updates: take_number(input) }
    }
}
