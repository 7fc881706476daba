use rustc_hash::FxHashSet;
use voxtile::mapper::MapView;
use voxtile::space::{LAST_VOXEL_INDEX, TileBox, VoxelBox};
use voxtile::{Aabb, Grid, TileIndex, VoxelIndex};

/// Voxels along the edge of a block: the unit of work, which does not depend on the tiles of the maps.
pub(crate) const BLOCK_EDGE: i64 = 128;

/// Index of a block along x, y and z.
pub(crate) type BlockIndex = [i32; 3];

/// Cube of voxels. It may exceed the range of indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Cube {
    pub(crate) min: [i64; 3],
    pub(crate) edge: usize,
}

impl Cube {
    pub(crate) fn of_block(block: BlockIndex) -> Self {
        Self { min: block.map(|k| i64::from(k) * BLOCK_EDGE), edge: BLOCK_EDGE as usize }
    }

    /// Returns the cube enlarged on all sides.
    pub(crate) fn grown(self, voxels: u32) -> Self {
        Self { min: self.min.map(|k| k - i64::from(voxels)), edge: self.edge + 2 * voxels as usize }
    }

    /// Voxel at a position in the cube. Only voxels with indices are observed.
    pub(crate) fn voxel_at(self, place: [usize; 3]) -> VoxelIndex {
        std::array::from_fn(|k| (self.min[k] + place[k] as i64) as i32)
    }

    /// The cube in metres.
    pub(crate) fn bounds_m(self, grid: &Grid) -> Aabb {
        let corner_m = |k: i64| k as f64 * grid.resolution_m();
        Aabb { min: self.min.map(corner_m), max: self.min.map(|k| corner_m(k + self.edge as i64)) }
    }

    /// The voxels that have indices.
    fn voxels(self) -> VoxelBox {
        let clamp = |k: i64| k.clamp(i64::from(i32::MIN), i64::from(LAST_VOXEL_INDEX) + 1) as i32;
        VoxelBox { min: self.min.map(clamp), end: self.min.map(|k| clamp(k + self.edge as i64)) }
    }

    /// Range of positions of a box of voxels in the cube, perhaps empty.
    pub(crate) fn positions_of(self, voxels: &VoxelBox) -> [[usize; 3]; 2] {
        let place = |k: usize, at: i32| (i64::from(at) - self.min[k]).clamp(0, self.edge as i64) as usize;
        [std::array::from_fn(|k| place(k, voxels.min[k])), std::array::from_fn(|k| place(k, voxels.end[k]))]
    }

    /// The tiles of a map that overlap the cube, in order.
    pub(crate) fn tiles(self, map: &impl MapView) -> Vec<TileIndex> {
        tiles_in(map, &self.voxels())
    }
}

/// The tiles of a map that overlap a box of voxels, in order.
pub(crate) fn tiles_in(map: &impl MapView, voxels: &VoxelBox) -> Vec<TileIndex> {
    /// Looking up this many tiles is cheaper than listing all tiles of a large map.
    const MAX_LOOKED_UP: u64 = 4096;
    if voxels.is_empty() {
        return Vec::new();
    }
    let grid = &map.config().grid;
    let last = voxels.end.map(|k| k - 1);
    let wanted = TileBox::new(grid.tile_of_voxel(voxels.min), grid.tile_of_voxel(last));
    let Some(tiles) = map.tile_bounds().and_then(|bounds| bounds.intersection(wanted)) else {
        return Vec::new();
    };
    if tiles.count() <= MAX_LOOKED_UP {
        return tiles.tiles().filter(|&tile| map.has_tile(tile)).collect();
    }
    map.tile_indices().into_iter().filter(|&tile| tiles.contains(tile)).collect()
}

/// The blocks that overlap tiles, by x, then y, then z.
pub(crate) fn blocks_of(grid: &Grid, tiles: impl Iterator<Item = TileIndex>) -> Vec<BlockIndex> {
    let mut blocks = FxHashSet::default();
    for tile in tiles {
        let voxels = grid.voxels_of_tile(tile);
        let [first, last] = [voxels.min, voxels.end.map(|k| k.saturating_sub(1))]
            .map(|corner| corner.map(|k| k.div_euclid(BLOCK_EDGE as i32)));
        for x in first[0]..=last[0] {
            for y in first[1]..=last[1] {
                blocks.extend((first[2]..=last[2]).map(|z| [x, y, z]));
            }
        }
    }
    let mut blocks: Vec<BlockIndex> = blocks.into_iter().collect();
    blocks.sort_unstable();
    blocks
}

/// Returns whether a tile may have occupied voxels, without reading it.
pub(crate) fn may_be_occupied(map: &impl MapView, tile: TileIndex) -> bool {
    map.version_of_tile(tile).is_none_or(|version| version.table.bytes == 0 || version.occupied > 0)
}
