use super::mapped_tiles::MappedTiles;
use super::tile_updates::{ScanUpdates, TileUpdates};
use crate::scan::ScanReport;
use crate::space::{BRICK_EDGE, BrickCode, BrickMask, Grid, TileIndex, VoxelIndex, VoxelKey, mask_of_box};
use rustc_hash::FxHashMap;

/// For each mapped tile the numbers of the bricks that overlap it, in Morton order. `indices` are the bricks': their
/// voxels' indices divided by 8.
pub(crate) fn bricks_by_tile(mapped: MappedTiles<'_>, indices: &[VoxelIndex]) -> Vec<(TileIndex, Vec<u32>)> {
    let mut tiles: FxHashMap<TileIndex, Vec<(BrickCode, u32)>> = FxHashMap::default();
    for (number, &index) in indices.iter().enumerate() {
        let code = brick_code(index);
        for tile in tiles_of_brick(mapped.grid, index).filter(|tile| mapped.has(*tile)) {
            tiles.entry(tile).or_default().push((code, number as u32));
        }
    }
    let in_order = |(tile, mut bricks): (TileIndex, Vec<(BrickCode, u32)>)| {
        bricks.sort_unstable();
        (tile, bricks.into_iter().map(|(_, number)| number).collect())
    };
    tiles.into_iter().map(in_order).collect()
}

/// Into how many tiles a brick is divided where tiles are smaller than bricks, at most; 1 where they are not.
///
/// A list by tile takes so many times the memory of the bricks that it is made of.
pub(crate) fn small_tiles_of_brick(grid: &Grid) -> usize {
    let (tile, brick) = (grid.voxels_per_tile_edge() as usize, BRICK_EDGE as usize);
    if tile >= brick {
        return 1;
    }
    // Tiles whose edge divides that of a brick are aligned with it; others may begin before it.
    let along_edge = if brick.is_multiple_of(tile) { brick / tile } else { (brick - 1).div_ceil(tile) + 1 };
    along_edge.pow(3)
}

/// Code of the brick with this index.
pub(crate) fn brick_code(index: VoxelIndex) -> BrickCode {
    BrickCode::of_voxel(index.map(|k| k * BRICK_EDGE))
}

/// The places of a brick that lie in a tile.
pub(crate) fn part_in_tile(grid: &Grid, tile: TileIndex, brick: VoxelIndex) -> BrickMask {
    let voxels = grid.voxels_of_tile(tile);
    let local = |corner: VoxelIndex| std::array::from_fn(|k| corner[k].saturating_sub(brick[k] * BRICK_EDGE));
    mask_of_box(local(voxels.min), local(voxels.end))
}

/// The tiles that a brick overlaps.
fn tiles_of_brick(grid: &Grid, brick: VoxelIndex) -> impl Iterator<Item = TileIndex> {
    let min = brick.map(|k| k * BRICK_EDGE);
    let first = grid.tile_of_voxel(min).to_array();
    let last = grid.tile_of_voxel(min.map(|k| k.saturating_add(BRICK_EDGE - 1))).to_array();
    (first[0]..=last[0]).flat_map(move |x| {
        (first[1]..=last[1]).flat_map(move |y| (first[2]..=last[2]).map(move |z| TileIndex::new(x, y, z)))
    })
}

/// Sorts tiles in Morton order of their lowest voxels; far apart, where the codes repeat, by index.
pub(crate) fn in_order_of_tiles(
    grid: &Grid,
    mut tiles: Vec<(TileIndex, TileUpdates)>,
    mut report: ScanReport,
) -> ScanUpdates {
    tiles.sort_by_cached_key(|(tile, _)| {
        (VoxelKey::from_index(grid.voxels_of_tile(*tile).min).morton(), *tile)
    });
    report.tiles_touched = tiles.len() as u64;
    ScanUpdates { tiles, report }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_brick_overlaps_more_small_tiles_than_the_bound() {
        for edge in 2..8 {
            let grid = Grid::new(1.0, f64::from(edge)).unwrap();
            let bricks = (-edge..edge).map(|k| [k, 0, k]);
            let most = bricks.map(|brick| tiles_of_brick(&grid, brick).count()).max().unwrap();
            assert!(most <= small_tiles_of_brick(&grid), "{most} tiles of {edge} voxels");
        }
        assert_eq!(
            [2, 3, 4, 5, 7].map(|n| small_tiles_of_brick(&Grid::new(1.0, n.into()).unwrap())),
            [64, 64, 8, 27, 8]
        );
        assert_eq!(small_tiles_of_brick(&Grid::new(1.0, 8.0).unwrap()), 1);
    }
}
