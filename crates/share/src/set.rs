use super::set_range::{LAST_CODE, SetPosition, SetRange};
use std::collections::BTreeMap;
use voxtile::Digest;
use voxtile::space::{
    BRICK_VOXELS, BrickCode, BrickMask, Grid, LAST_VOXEL_INDEX, MortonCode, TileIndex, VoxelBox, VoxelIndex,
    VoxelKey, is_in_mask, places,
};

/// Set of voxels, grouped by tile, with digests. A sender shares a set, and a receiver mirrors it.
#[derive(Clone, Debug)]
pub struct VoxelSet {
    grid: Grid,
    pub(super) tiles: BTreeMap<TileIndex, TileVoxels>,
    /// Number of bricks in all tiles.
    pub(super) bricks: usize,
    len: u64,
    /// Cached digest; `None` after a change.
    digest: Option<Digest>,
}

/// The voxels of a tile, by brick. Never empty.
#[derive(Clone, Debug, Default)]
pub(super) struct TileVoxels {
    pub(super) bricks: BTreeMap<BrickCode, BrickMask>,
    len: u64,
    /// Cached digest; `None` after a change.
    digest: Option<[u8; 32]>,
}

const LABEL: &[u8] = b"voxtile-set-1";

/// Number of bytes of Morton codes that are hashed at a time.
const CODES_AT_A_TIME: usize = 16 << 10;

impl VoxelSet {
    /// Creates an empty set of voxels of a grid.
    pub fn new(grid: Grid) -> Self {
        Self { grid, tiles: BTreeMap::new(), bricks: 0, len: 0, digest: None }
    }

    /// Returns the grid of the voxels and tiles.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Returns the number of voxels.
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Returns whether the set is empty.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the number of tiles that hold voxels.
    pub fn tile_count(&self) -> usize {
        self.tiles.len()
    }

    /// Returns the tiles that hold voxels, in order.
    pub fn tiles(&self) -> impl Iterator<Item = TileIndex> {
        self.tiles.keys().copied()
    }

    /// Returns whether a voxel is in the set.
    pub fn contains(&self, voxel: VoxelIndex) -> bool {
        let code = VoxelKey::from_index(voxel).morton();
        let tile = self.tiles.get(&self.grid.tile_of_voxel(voxel));
        tile.and_then(|tile| tile.bricks.get(&code.brick()))
            .is_some_and(|mask| is_in_mask(mask, code.place_in_brick()))
    }

    /// Adds or removes a voxel. Returns whether the set changed. A voxel with an index above [`LAST_VOXEL_INDEX`] is
    /// ignored.
    pub fn put(&mut self, voxel: VoxelIndex, is_in: bool) -> bool {
        if voxel.iter().any(|&k| k > LAST_VOXEL_INDEX) {
            return false;
        }
        let code = VoxelKey::from_index(voxel).morton();
        let (brick, place) = (code.brick(), code.place_in_brick());
        let tile = self.grid.tile_of_voxel(voxel);
        let mut mask = self.brick(tile, brick);
        if is_in_mask(&mask, place) == is_in {
            return false;
        }
        mask[place / 64] ^= 1 << (place % 64);
        self.put_brick(tile, brick, mask);
        true
    }

    /// Returns the voxels of a brick in a tile.
    pub fn brick(&self, tile: TileIndex, brick: BrickCode) -> BrickMask {
        self.tiles.get(&tile).and_then(|tile| tile.bricks.get(&brick)).copied().unwrap_or([0; 8])
    }

    /// Returns the bricks between `from` and `last`, both included, in order.
    pub(super) fn bricks_between(
        &self,
        from: (TileIndex, BrickCode),
        last: (TileIndex, BrickCode),
    ) -> impl Iterator<Item = ((TileIndex, BrickCode), BrickMask)> {
        let tiles = (from <= last).then(|| self.tiles.range(from.0..=last.0));
        tiles.into_iter().flatten().flat_map(move |(&index, tile)| {
            let first = if index == from.0 { from.1 } else { BrickCode(0) };
            let end = if index == last.0 { last.1 } else { BrickCode(BrickCode::END) };
            let bricks = (first <= end).then(|| tile.bricks.range(first..=end));
            bricks.into_iter().flatten().map(move |(&brick, &mask)| ((index, brick), mask))
        })
    }

    /// Replaces the voxels of a brick in a tile.
    pub(super) fn put_brick(&mut self, tile: TileIndex, brick: BrickCode, mask: BrickMask) {
        let of_tile = self.tiles.entry(tile).or_default();
        let count = |mask: &BrickMask| mask.iter().map(|word| u64::from(word.count_ones())).sum::<u64>();
        let before = match mask {
            [0, 0, 0, 0, 0, 0, 0, 0] => of_tile.bricks.remove(&brick),
            _ => of_tile.bricks.insert(brick, mask),
        };
        let (before, after) = (before.as_ref().map_or(0, count), count(&mask));
        // A brick exists if and only if it has voxels.
        self.bricks = self.bricks + usize::from(after > 0) - usize::from(before > 0);
        of_tile.len = of_tile.len + after - before;
        of_tile.digest = None;
        self.digest = None;
        self.len = self.len + after - before;
        if of_tile.bricks.is_empty() {
            self.tiles.remove(&tile);
        }
    }

    /// Returns the voxels in order.
    pub fn iter(&self) -> impl Iterator<Item = VoxelIndex> {
        self.in_range(SetRange::ALL)
    }

    /// Returns the voxels of a range, in order.
    pub fn in_range(&self, range: SetRange) -> impl Iterator<Item = VoxelIndex> {
        let tiles = range.is_valid().then(|| self.tiles.range(range.first.tile..=range.last.tile));
        tiles.into_iter().flatten().flat_map(move |(&index, tile)| {
            let first = if index == range.first.tile { range.first.code } else { 0 };
            let last = if index == range.last.tile { range.last.code } else { LAST_CODE };
            let min = self.grid.voxels_of_tile(index).min;
            let bricks = (first <= last)
                .then(|| tile.bricks.range(MortonCode(first).brick()..=MortonCode(last).brick()));
            let codes = bricks
                .into_iter()
                .flatten()
                .flat_map(|(brick, mask)| places(*mask).map(|place| brick.voxel(place)));
            codes
                .filter(move |code| (first..=last).contains(&code.0))
                .map(move |code| code.to_key().to_index_from(min))
        })
    }

    /// Returns the voxels in a box. The cost depends on the existing tiles and voxels, not on the size of the box.
    pub(super) fn in_box(&self, voxels: &VoxelBox) -> impl Iterator<Item = VoxelIndex> {
        let last = voxels.end.map(|end| end.saturating_sub(1));
        let (first, last) = (self.grid.tile_of_voxel(voxels.min), self.grid.tile_of_voxel(last));
        let tiles = (!voxels.is_empty()).then(|| {
            let from = TileIndex::new(first.x, i32::MIN, i32::MIN);
            self.tiles.range(from..=TileIndex::new(last.x, i32::MAX, i32::MAX))
        });
        let reaches_in = move |tile: &TileIndex| {
            (first.y..=last.y).contains(&tile.y) && (first.z..=last.z).contains(&tile.z)
        };
        let tiles = tiles.into_iter().flatten().filter(move |(index, _)| reaches_in(index));
        tiles.flat_map(move |(&index, tile)| {
            let min = self.grid.voxels_of_tile(index).min;
            let codes =
                tile.bricks.iter().flat_map(|(brick, mask)| places(*mask).map(|place| brick.voxel(place)));
            codes.map(move |code| code.to_key().to_index_from(min)).filter(|voxel| voxels.contains(*voxel))
        })
    }

    /// Returns the position of a voxel in the order of the set.
    pub fn position_of(&self, voxel: VoxelIndex) -> SetPosition {
        position_of(&self.grid, voxel)
    }

    /// Returns the digest of a tile: BLAKE3 over the sorted Morton codes of its voxels, six bytes each, little-endian.
    /// Returns `None` for an empty tile.
    pub fn digest_of_tile(&mut self, tile: TileIndex) -> Option<[u8; 32]> {
        self.tiles.get_mut(&tile).map(TileVoxels::digest)
    }

    /// Returns the digest of the set: BLAKE3 over "voxtile-set-1", the bits of resolution and tile size, and each
    /// tile's index and digest, in order. Equal sets have equal digests. The digest is cached until the set changes.
    pub fn digest(&mut self) -> Digest {
        if let Some(digest) = self.digest {
            return digest;
        }
        let mut hasher = blake3::Hasher::new();
        hasher.update(LABEL);
        hasher.update(&self.grid.resolution_m().to_bits().to_le_bytes());
        hasher.update(&self.grid.tile_size_m().to_bits().to_le_bytes());
        self.add_tiles(&mut hasher, SetRange::ALL.first.tile, SetRange::ALL.last.tile);
        *self.digest.insert(Digest::from_bytes(*hasher.finalize().as_bytes()))
    }

    /// Returns the number of voxels in the tiles between `first` and `last`, and the first eight bytes of BLAKE3 over
    /// the indices and digests of these tiles.
    pub(super) fn short_digest(&mut self, first: TileIndex, last: TileIndex) -> (u64, [u8; 8]) {
        let mut hasher = blake3::Hasher::new();
        let voxels = self.add_tiles(&mut hasher, first, last);
        let digest = hasher.finalize();
        (voxels, std::array::from_fn(|k| digest.as_bytes()[k]))
    }

    fn add_tiles(&mut self, hasher: &mut blake3::Hasher, first: TileIndex, last: TileIndex) -> u64 {
        let mut voxels = 0;
        if first > last {
            return 0;
        }
        for (index, tile) in self.tiles.range_mut(first..=last) {
            index.to_array().iter().for_each(|k| {
                hasher.update(&k.to_le_bytes());
            });
            hasher.update(&tile.digest());
            voxels += tile.len;
        }
        voxels
    }

    /// Returns the tiles that hold voxels between `first` and `last`, both included.
    pub(super) fn tiles_between(&self, first: TileIndex, last: TileIndex) -> Vec<TileIndex> {
        if first > last {
            Vec::new()
        } else {
            self.tiles.range(first..=last).map(|(index, _)| *index).collect()
        }
    }

    /// Returns whether more than one tile between `first` and `last`, both included, holds voxels.
    pub(super) fn has_several_tiles(&self, first: TileIndex, last: TileIndex) -> bool {
        first < last && self.tiles.range(first..=last).nth(1).is_some()
    }

    /// Returns the number of voxels of a tile.
    pub fn voxels_of_tile(&self, tile: TileIndex) -> u64 {
        self.tiles.get(&tile).map_or(0, |tile| tile.len)
    }

    /// Returns whether a tile holds voxels.
    pub fn has_tile(&self, tile: TileIndex) -> bool {
        self.tiles.contains_key(&tile)
    }
}

/// Sets are equal if they have the same grid and the same voxels.
impl PartialEq for VoxelSet {
    fn eq(&self, other: &Self) -> bool {
        let bricks = |set: &Self| {
            set.tiles.iter().map(|(index, tile)| (*index, tile.bricks.clone())).collect::<Vec<_>>()
        };
        self.grid == other.grid && self.len == other.len && bricks(self) == bricks(other)
    }
}

impl TileVoxels {
    fn digest(&mut self) -> [u8; 32] {
        *self.digest.get_or_insert_with(|| {
            let mut hasher = blake3::Hasher::new();
            // Hash many bricks at a time, because the hash is several times faster on long inputs.
            let mut codes = Vec::with_capacity(CODES_AT_A_TIME + 6 * BRICK_VOXELS);
            for (brick, mask) in &self.bricks {
                codes.extend(places(*mask).flat_map(|place| {
                    let [a, b, c, d, e, f, ..] = brick.voxel(place).0.to_le_bytes();
                    [a, b, c, d, e, f]
                }));
                if codes.len() >= CODES_AT_A_TIME {
                    hasher.update(&codes);
                    codes.clear();
                }
            }
            hasher.update(&codes);
            *hasher.finalize().as_bytes()
        })
    }
}

pub(super) fn position_of(grid: &Grid, voxel: VoxelIndex) -> SetPosition {
    SetPosition { tile: grid.tile_of_voxel(voxel), code: VoxelKey::from_index(voxel).morton().0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_digest_is_computed_once_for_each_change() {
        let mut set = VoxelSet::new(Grid::new(0.1, 1.0).unwrap());
        let empty = set.digest();
        for k in 0..3 {
            assert!(set.put([100 * k, 0, 0], true));
            let digest = set.digest();
            assert_ne!(digest, empty);
            // The cached digest is returned without a new computation.
            let cached = Digest::from_bytes([7; 32]);
            set.digest = Some(cached);
            assert_eq!(set.digest(), cached);
            assert!(!set.put([100 * k, 0, 0], true), "no change");
            assert_eq!(set.digest(), cached);
            assert!(set.put([7, 7, 7], true) && set.put([7, 7, 7], false));
            assert_eq!(set.digest(), digest);
        }
        assert_eq!(set.cut_to_bytes(0), 3);
        assert_eq!(set.digest(), empty);
    }
}
