use super::mapped_tiles::MappedTiles;
use super::tile_updates::{ScanUpdates, TileUpdates};
use crate::scan::ScanReport;
use crate::space::{BRICK_EDGE, BrickCode, BrickMask, Grid, TileIndex, VoxelIndex, VoxelKey, mask_of_box};
use rustc_hash::FxHashMap;

/// Returns, for each mapped tile, the numbers of the bricks that are within `reach` voxels of it, in Morton order; with
/// 0, of the bricks that overlap it. `indices` are the indices of the bricks: the indices of their voxels divided by 8.
pub(crate) fn bricks_by_tile(
    mapped: MappedTiles<'_>,
    indices: &[VoxelIndex],
    reach: i32,
) -> Vec<(TileIndex, Vec<u32>)> {
    let mut tiles: FxHashMap<TileIndex, Vec<(BrickCode, u32)>> = FxHashMap::default();
    for (number, &index) in indices.iter().enumerate() {
        let code = brick_code(index);
        for tile in tiles_of_brick(mapped.grid, index, reach).filter(|tile| mapped.has(*tile)) {
            tiles.entry(tile).or_default().push((code, number as u32));
        }
    }
    let in_order = |(tile, mut bricks): (TileIndex, Vec<(BrickCode, u32)>)| {
        bricks.sort_unstable();
        (tile, bricks.into_iter().map(|(_, number)| number).collect())
    };
    tiles.into_iter().map(in_order).collect()
}

/// Returns the number of parts into which tiles divide a brick, averaged over the bricks of a map and rounded: 1 for
/// tiles that are much larger than bricks.
///
/// Bricks split at tile borders take so many times the memory of the whole bricks.
pub(crate) fn mean_tiles_of_brick(grid: &Grid) -> usize {
    let (tile, brick) = (grid.voxels_per_tile_edge() as usize, BRICK_EDGE as usize);
    // Within tiles, bricks begin at multiples of `step`, at each one equally often.
    let step = 1 << tile.trailing_zeros().min(BRICK_EDGE.trailing_zeros());
    let parts_by_tile = (tile + brick - step).pow(3);
    (parts_by_tile as f64 / tile.pow(3) as f64).round() as usize
}

pub(crate) fn brick_code(index: VoxelIndex) -> BrickCode {
    BrickCode::of_voxel(index.map(|k| k * BRICK_EDGE))
}

/// Returns the index of a brick in or near a tile. Codes of distant bricks repeat.
pub(crate) fn brick_index(grid: &Grid, tile: TileIndex, code: BrickCode) -> VoxelIndex {
    let first = grid.voxels_of_tile(tile).min;
    let (VoxelKey(origin), VoxelKey(key)) = (VoxelKey::from_index(first), code.voxel(0).to_key());
    std::array::from_fn(|k| {
        let offset = key[k].wrapping_sub(origin[k]) as i16;
        first[k].wrapping_add(i32::from(offset)).div_euclid(BRICK_EDGE)
    })
}

/// Returns the mask of a brick's voxels that are in a tile.
pub(crate) fn part_in_tile(grid: &Grid, tile: TileIndex, brick: VoxelIndex) -> BrickMask {
    let voxels = grid.voxels_of_tile(tile);
    let local = |corner: VoxelIndex| std::array::from_fn(|k| corner[k].saturating_sub(brick[k] * BRICK_EDGE));
    mask_of_box(local(voxels.min), local(voxels.end))
}

fn tiles_of_brick(grid: &Grid, brick: VoxelIndex, reach: i32) -> impl Iterator<Item = TileIndex> {
    let min = brick.map(|k| k * BRICK_EDGE);
    let first = grid.tile_of_voxel(min.map(|k| k.saturating_sub(reach))).to_array();
    let last = grid.tile_of_voxel(min.map(|k| k.saturating_add(BRICK_EDGE - 1 + reach))).to_array();
    (first[0]..=last[0]).flat_map(move |x| {
        (first[1]..=last[1]).flat_map(move |y| (first[2]..=last[2]).map(move |z| TileIndex::new(x, y, z)))
    })
}

/// Sorts tiles in Morton order of their lowest voxels; distant tiles, whose codes repeat, by index.
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
    fn tiles_divide_bricks_as_estimated() {
        for edge in [2, 3, 4, 5, 6, 7, 8, 9, 12, 20, 31, 32, 100] {
            let grid = Grid::new(1.0, f64::from(edge)).unwrap();
            let along_axis: usize = (-edge..edge).map(|k| tiles_of_brick(&grid, [k, 0, 0], 0).count()).sum();
            let aside = f64::from((BRICK_EDGE + edge - 1) / edge).powi(2);
            let mean = along_axis as f64 / f64::from(2 * edge) / aside;
            assert_eq!(mean_tiles_of_brick(&grid), mean.powi(3).round() as usize, "tiles of {edge} voxels");
        }
    }
}
