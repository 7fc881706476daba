use super::{TileIndex, hash_table_bytes};
use integer_encoding::VarInt;
use rustc_hash::FxHashMap;
use std::fmt;
use std::iter::Peekable;

/// Sorted map from tiles to values in little memory: all entries except recent ones are packed. A tile takes about 20
/// bytes with its file checksums as the value, and 5 bytes without a value.
///
/// ```text
/// recent  hash map: tile -> value, or a mark that the tile was removed from the blocks
/// blocks  sorted: first tile, bytes of up to 64 tiles: differences of indices and of values, as variable-length
/// integers
/// ```
///
/// Once a sixteenth of the tiles is recent, these are merged into their blocks. A change therefore costs the packing of
/// about sixteen tiles, and a look-up the unpacking of at most 64. Many changes at once are sorted and merged into their
/// blocks without a look-up.
#[derive(Clone)]
pub struct TileTable<V> {
    recent: FxHashMap<TileIndex, Option<V>>,
    blocks: Vec<Block>,
    block_bytes: usize,
    tiles: usize,
}

/// Value of a [`TileTable`].
pub trait TileValue: Copy + Default {
    /// Appends the value as a difference from the previous one.
    fn pack(self, before: Self, out: &mut Vec<u8>);
    /// Reads the value from the front; `before` is the previous one.
    fn unpack(before: Self, input: &mut &[u8]) -> Self;
    /// Passes over the value at the front.
    fn skip(input: &mut &[u8]) {
        Self::unpack(Self::default(), input);
    }
}

#[derive(Clone)]
struct Block {
    first: TileIndex,
    tiles: u32,
    bytes: Box<[u8]>,
}

/// Maximum number of tiles in a block.
const BLOCK_TILES: usize = 64;
/// Number of recent tiles that is allowed in a table of any size.
const MIN_RECENT: usize = 1024;
/// Divisor for the maximum share of recent tiles.
const RECENT_PART: usize = 16;
/// Number of changes that are merged at once, more in large tables, because a merge passes over all blocks. Fewer than
/// the minimum are inserted one by one.
const MIN_MERGED: usize = 64;
const MAX_MERGED: usize = 1 << 10;
/// Divisor for the share of the tiles that is merged at once into large tables.
const MERGED_PART: usize = 64;
/// Overhead of the allocator per block.
const ALLOCATION_BYTES: usize = 16;

impl<V: TileValue> TileTable<V> {
    /// Number of tiles.
    pub fn len(&self) -> usize {
        self.tiles
    }

    /// Returns whether the table is empty.
    pub fn is_empty(&self) -> bool {
        self.tiles == 0
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        hash_table_bytes::<(TileIndex, Option<V>)>(self.recent.capacity())
            + self.blocks.capacity() * size_of::<Block>()
            + self.block_bytes
    }

    /// The value of a tile.
    pub fn get(&self, tile: TileIndex) -> Option<V> {
        match self.recent.get(&tile) {
            Some(value) => *value,
            None => self.packed(tile),
        }
    }

    /// Returns whether the table contains a tile.
    pub fn contains(&self, tile: TileIndex) -> bool {
        self.get(tile).is_some()
    }

    /// Sets the value of a tile.
    pub fn insert(&mut self, tile: TileIndex, value: V) {
        self.tiles += usize::from(!self.contains(tile));
        self.recent.insert(tile, Some(value));
        self.pack_if_due();
    }

    /// Removes a tile; returns whether it existed.
    pub fn remove(&mut self, tile: TileIndex) -> bool {
        if !self.contains(tile) {
            return false;
        }
        if self.tiles == 1 {
            *self = Self::default(); // Also frees its memory.
            return true;
        }
        self.tiles -= 1;
        match self.packed(tile) {
            Some(_) => self.recent.insert(tile, None),
            None => self.recent.remove(&tile),
        };
        self.pack_if_due();
        true
    }

    /// All tiles and values, in order.
    pub fn iter(&self) -> impl Iterator<Item = (TileIndex, V)> {
        let packed = self.blocks.iter().flat_map(Block::iter);
        Merged { packed: packed.peekable(), recent: self.sorted_recent(|value| value).into_iter().peekable() }
    }

    fn sorted_recent<T>(&self, of_value: impl Fn(V) -> T) -> Vec<(TileIndex, Option<T>)> {
        let recent = self.recent.iter().map(|(&tile, &value)| (tile, value.map(&of_value)));
        let mut recent: Vec<_> = recent.collect();
        recent.sort_unstable_by_key(|&(tile, _)| tile);
        recent
    }

    /// All tiles, in order.
    pub fn tiles(&self) -> impl Iterator<Item = TileIndex> {
        let packed = self.blocks.iter().flat_map(Block::tiles::<V>).map(|tile| (tile, ()));
        let recent = self.sorted_recent(|_| ()).into_iter();
        Merged { packed: packed.peekable(), recent: recent.peekable() }.map(|(tile, ())| tile)
    }

    /// All values, in the order of the tiles.
    pub fn values(&self) -> impl Iterator<Item = V> {
        self.iter().map(|(_, value)| value)
    }

    fn packed(&self, tile: TileIndex) -> Option<V> {
        let after = self.blocks.partition_point(|block| block.first <= tile);
        let block = self.blocks.get(after.checked_sub(1)?)?;
        let (found, value) = block.iter().find(|(other, _)| *other >= tile)?;
        (found == tile).then_some(value)
    }

    fn pack_if_due(&mut self) {
        if self.recent.len() > MIN_RECENT.max(self.tiles / RECENT_PART) {
            self.pack();
        }
    }

    /// Merges recent tiles into their blocks.
    fn pack(&mut self) {
        let mut recent: Vec<_> = std::mem::take(&mut self.recent).into_iter().collect();
        recent.sort_unstable_by_key(|&(tile, _)| tile);
        self.merge(&recent);
    }

    /// Merges changes, sorted by tile, into their blocks; other blocks are unchanged. No tile may be recent.
    fn merge(&mut self, mut recent: &[(TileIndex, Option<V>)]) {
        let before = std::mem::take(&mut self.blocks);
        let ends: Vec<_> = before.iter().skip(1).map(|block| block.first).collect();
        let mut blocks = Vec::with_capacity(before.len());
        let mut before = before.into_iter();
        for number in 0..=ends.len() {
            let end =
                ends.get(number).map_or(recent.len(), |end| recent.partition_point(|(tile, _)| tile < end));
            let changes;
            (changes, recent) = recent.split_at(end);
            match before.next() {
                Some(block) if changes.is_empty() => blocks.push(block),
                block => {
                    let merged: Vec<(TileIndex, V)> = match block {
                        Some(block) => {
                            let (packed, recent) =
                                (block.iter().peekable(), changes.iter().copied().peekable());
                            Merged { packed, recent }.collect()
                        }
                        None => changes.iter().filter_map(|&(tile, value)| Some((tile, value?))).collect(),
                    };
                    // The blocks get equal sizes, so that the next few tiles do not split them again.
                    let parts = merged.len().div_ceil(BLOCK_TILES).max(1);
                    blocks.extend(merged.chunks(merged.len().div_ceil(parts).max(1)).map(Block::of));
                }
            }
        }
        self.block_bytes = blocks.iter().map(|block| block.bytes.len() + ALLOCATION_BYTES).sum();
        self.tiles = blocks.iter().map(|block| block.tiles as usize).sum();
        self.blocks = blocks;
    }

    /// Inserts many tiles. The last of equal tiles counts.
    fn insert_all(&mut self, tiles: &mut Vec<(TileIndex, Option<V>)>) {
        if tiles.len() < MIN_MERGED.max(self.blocks.len() / MIN_MERGED) {
            let tiles = tiles.iter().filter_map(|&(tile, value)| Some((tile, value?)));
            return tiles.for_each(|(tile, value)| self.insert(tile, value));
        }
        self.pack();
        // Sorting takes memory, and most lists are sorted.
        if !tiles.is_sorted_by_key(|(tile, _)| *tile) {
            tiles.sort_by_key(|&(tile, _)| tile);
        }
        tiles.dedup_by(|next, kept| {
            let is_same = next.0 == kept.0;
            if is_same {
                *kept = *next;
            }
            is_same
        });
        self.merge(tiles);
    }
}

impl Block {
    /// Packs a non-empty sorted list.
    fn of<V: TileValue>(tiles: &[(TileIndex, V)]) -> Self {
        let first = tiles.first().map(|&(tile, _)| tile).unwrap_or_default();
        let (mut bytes, mut before) = (Vec::new(), (first, V::default()));
        for &(tile, value) in tiles {
            for (axis, index) in tile.to_array().into_iter().enumerate() {
                put_number(i64::from(index) - i64::from(before.0.to_array()[axis]), &mut bytes);
            }
            value.pack(before.1, &mut bytes);
            before = (tile, value);
        }
        Self { first, tiles: tiles.len() as u32, bytes: bytes.into() }
    }

    fn iter<V: TileValue>(&self) -> impl Iterator<Item = (TileIndex, V)> {
        let (mut input, mut before) = (&*self.bytes, (self.first, V::default()));
        std::iter::from_fn(move || {
            if input.is_empty() {
                return None;
            }
            before = (take_index(before.0, &mut input), V::unpack(before.1, &mut input));
            Some(before)
        })
    }

    fn tiles<V: TileValue>(&self) -> impl Iterator<Item = TileIndex> {
        let (mut input, mut tile) = (&*self.bytes, self.first);
        std::iter::from_fn(move || {
            if input.is_empty() {
                return None;
            }
            tile = take_index(tile, &mut input);
            V::skip(&mut input);
            Some(tile)
        })
    }
}

/// Appends a number as a varint; small negative numbers are also short.
pub fn put_number(number: impl VarInt, out: &mut Vec<u8>) {
    let mut bytes = [0; 10];
    let length = number.encode_var(&mut bytes);
    out.extend_from_slice(&bytes[..length]);
}

/// Reads a number from the front. Packed bytes never leave memory, so it always exists.
pub fn take_number<N: VarInt + Default>(input: &mut &[u8]) -> N {
    let (number, length) = N::decode_var(input).unwrap_or_default();
    *input = input.get(length..).unwrap_or_default();
    number
}

/// Reads the index of a tile: its difference from that of the tile before.
#[inline]
fn take_index(before: TileIndex, input: &mut &[u8]) -> TileIndex {
    let mut step = || match **input {
        // Most tiles are neighbours of the one before: their steps are single bytes.
        [byte @ 0..0x80, ref rest @ ..] => {
            *input = rest;
            i64::from(byte >> 1) ^ -i64::from(byte & 1)
        }
        _ => take_number::<i64>(input),
    };
    before.to_array().map(|index| (i64::from(index) + step()) as i32).into()
}

/// Passes over numbers at the front.
pub fn skip_numbers(numbers: usize, input: &mut &[u8]) {
    for _ in 0..numbers {
        *input = match **input {
            [0..0x80, ref rest @ ..]
            | [_, 0..0x80, ref rest @ ..]
            | [_, _, 0..0x80, ref rest @ ..]
            | [_, _, _, 0..0x80, ref rest @ ..] => rest,
            _ => {
                let last = input.iter().position(|byte| byte & 0x80 == 0);
                last.and_then(|last| input.get(last + 1..)).unwrap_or_default()
            }
        };
    }
}

/// Reads four bytes from the front, for numbers that a varint would not shorten.
pub fn take_u32(input: &mut &[u8]) -> u32 {
    let (number, rest) =
        input.split_first_chunk().map_or(([0; 4], &[][..]), |(number, rest)| (*number, rest));
    *input = rest;
    u32::from_le_bytes(number)
}

/// Merges two sorted sequences of tiles; recent values override packed ones.
struct Merged<P: Iterator, R: Iterator> {
    packed: Peekable<P>,
    recent: Peekable<R>,
}

impl<V, P, R> Iterator for Merged<P, R>
where
    P: Iterator<Item = (TileIndex, V)>,
    R: Iterator<Item = (TileIndex, Option<V>)>,
{
    type Item = (TileIndex, V);

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let Some(&(recent, _)) = self.recent.peek() else { return self.packed.next() };
            if let Some(before) = self.packed.next_if(|(tile, _)| *tile < recent) {
                return Some(before);
            }
            self.packed.next_if(|(tile, _)| *tile == recent);
            if let Some((tile, Some(value))) = self.recent.next() {
                return Some((tile, value));
            }
        }
    }

    /// Most tables have no recent tiles, and the packed ones are then passed in simple loops.
    fn fold<B, F: FnMut(B, Self::Item) -> B>(mut self, mut state: B, mut visit: F) -> B {
        while self.recent.peek().is_some() {
            let Some(next) = self.next() else { return state };
            state = visit(state, next);
        }
        self.packed.fold(state, visit)
    }
}

impl TileValue for () {
    fn pack(self, (): Self, _: &mut Vec<u8>) {}
    fn unpack((): Self, _: &mut &[u8]) -> Self {}
}

impl<V> Default for TileTable<V> {
    fn default() -> Self {
        Self { recent: FxHashMap::default(), blocks: Vec::new(), block_bytes: 0, tiles: 0 }
    }
}

impl<V: TileValue> Extend<(TileIndex, V)> for TileTable<V> {
    fn extend<I: IntoIterator<Item = (TileIndex, V)>>(&mut self, tiles: I) {
        let (mut tiles, mut some) = (tiles.into_iter(), Vec::new());
        loop {
            some.clear();
            let most = MAX_MERGED.max(self.tiles / MERGED_PART);
            some.extend(tiles.by_ref().take(most).map(|(tile, value)| (tile, Some(value))));
            if some.is_empty() {
                break;
            }
            self.insert_all(&mut some);
        }
    }
}

impl<V: TileValue> FromIterator<(TileIndex, V)> for TileTable<V> {
    fn from_iter<I: IntoIterator<Item = (TileIndex, V)>>(tiles: I) -> Self {
        let mut table = Self::default();
        table.extend(tiles);
        table
    }
}

impl<V: TileValue + PartialEq> PartialEq for TileTable<V> {
    fn eq(&self, other: &Self) -> bool {
        self.tiles == other.tiles && self.iter().eq(other.iter())
    }
}

impl<V: TileValue + fmt::Debug> fmt::Debug for TileTable<V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_map().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::{FileChecksum, TileVersion};
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    fn version(seed: u64) -> TileVersion {
        let (bytes, crc) = (18 * (seed % 5000) + 96, (seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as u32);
        let table = FileChecksum { bytes, crc };
        let octree = FileChecksum { bytes: bytes / 30, crc: !crc };
        TileVersion {
            scan_number: seed % 977,
            table,
            octree,
            voxels: seed % 5000,
            occupied: seed % 300 % (seed % 5000 + 1),
        }
    }

    /// Tiles close to each other and at the limits of the index range.
    fn index() -> impl Strategy<Value = TileIndex> {
        let axis = prop_oneof![40 => -8..8_i32, 1 => Just(i32::MIN), 1 => Just(i32::MAX), 1 => any::<i32>()];
        prop::array::uniform3(axis).prop_map(TileIndex::from)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn it_equals_a_map_after_any_changes(
            changes in prop::collection::vec((index(), prop::option::weighted(0.7, any::<u64>())), 0..6000),
        ) {
            let (mut table, mut naive) = (TileTable::default(), BTreeMap::new());
            for (number, &(tile, value)) in changes.iter().enumerate() {
                match value {
                    Some(seed) => {
                        table.insert(tile, version(seed));
                        naive.insert(tile, version(seed));
                    }
                    None => prop_assert_eq!(table.remove(tile), naive.remove(&tile).is_some()),
                }
                match number % 997 {
                    0 => table.pack(),
                    7 | 500 => {
                        let many: Vec<_> = changes.iter().rev().step_by(1 + number % 50).collect();
                        let many = many.iter().filter_map(|(tile, seed)| Some((*tile, version((*seed)?))));
                        naive.extend(many.clone());
                        table.extend(many);
                    }
                    _ => {}
                }
                prop_assert_eq!(table.len(), naive.len());
            }
            for (tile, _) in changes {
                prop_assert_eq!(table.get(tile), naive.get(&tile).copied());
            }
            let collected: TileTable<TileVersion> = naive.iter().map(|(tile, value)| (*tile, *value)).collect();
            prop_assert!(collected == table && collected.len() == naive.len());
            prop_assert!(table.tiles().eq(naive.keys().copied()));
            // Internal iteration, from the first tile and from a later one.
            for first in [0, 1, naive.len() / 2] {
                let (mut tiles, mut left) = (Vec::new(), table.tiles());
                (0..first).for_each(|_| _ = left.next());
                left.for_each(|tile| tiles.push(tile));
                prop_assert!(tiles.iter().eq(naive.keys().skip(first)));
            }
            prop_assert!(table.iter().eq(naive));
        }
    }

    #[test]
    fn a_tile_takes_less_than_40_bytes_and_its_index_less_than_10() {
        let tiles = || (0..100_000).map(|k| TileIndex::new(k / 2500, k / 10 % 250, k % 10));
        let versions: TileTable<_> =
            (0..).map(version).zip(tiles()).map(|(version, tile)| (tile, version)).collect();
        assert!(versions.bytes() < 40 * versions.len(), "{} bytes a tile", versions.bytes() / versions.len());
        let indices: TileTable<()> = tiles().map(|tile| (tile, ())).collect();
        assert!(indices.bytes() < 10 * indices.len(), "{} bytes a tile", indices.bytes() / indices.len());
    }
}
