//! Range of OctoMap's keys, and the error for maps that exceed it.

use crate::error::Error;
use crate::space::{Grid, Point, TileIndex, VoxelBox, VoxelIndex};

/// Voxels in the range of OctoMap's keys.
pub(super) const REACH: VoxelBox = VoxelBox { min: [-32768; 3], end: [32768; 3] };

/// Error for a voxel without an OctoMap key. If the tiles of a file are given, it suggests an origin.
pub(super) fn out_of_reach(grid: &Grid, voxel: VoxelIndex, tiles: Option<&[TileIndex]>) -> Error {
    let half_m = f64::from(REACH.end[0]) * grid.resolution_m();
    let (center, width_m) = (grid.center_m(voxel), 2.0 * half_m);
    let hint = match tiles.map(|tiles| origin_for(grid, tiles)) {
        None => "export a region (`region`) inside".to_owned(),
        Some(Some([x, y, z])) => {
            format!("`origin` {x} {y} {z} makes the whole map fit, a region (`region`) a part of it")
        }
        Some(None) => format!(
            "no `origin` is sufficient, because the map is wider than the {width_m} m of the whole key range: export \
             regions (`region`), each with an `origin` inside"
        ),
    };
    let reason = format!(
        "the voxel at {center:?} m is outside of OctoMap's key range, {half_m} m around the origin at this resolution; \
         {hint}"
    );
    Error::argument("octree", reason)
}

/// Returns a voxel corner in metres, as round as possible, from which all tiles are in range; `None` if there is none.
fn origin_for(grid: &Grid, tiles: &[TileIndex]) -> Option<Point> {
    let boxes = || tiles.iter().map(|&tile| grid.voxels_of_tile(tile));
    let mut origin_m = [0.0; 3];
    for (axis, origin_m) in origin_m.iter_mut().enumerate() {
        let min = boxes().map(|voxels| i64::from(voxels.min[axis])).min()?;
        let end = boxes().map(|voxels| i64::from(voxels.end[axis])).max()?;
        let fits = |origin: i64| {
            min - origin >= i64::from(REACH.min[axis]) && end - origin <= i64::from(REACH.end[axis])
        };
        let middle = (min + end).div_euclid(2);
        let round = |step: i64| (middle + step / 2).div_euclid(step) * step;
        let candidates = [0].into_iter().chain([10_000, 1_000, 100, 10, 1].map(round));
        let origin = candidates.into_iter().find(|&origin| fits(origin))?;
        *origin_m = grid.corner_m(i32::try_from(origin).ok()?);
    }
    Some(origin_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_suggested_origin_is_round_and_makes_all_tiles_fit() {
        let grid = Grid::new(0.1, 10.0).unwrap();
        let tiles = [TileIndex::new(50_000, 400_012, 1), TileIndex::new(50_200, 400_100, -2)];
        assert_eq!(origin_for(&grid, &tiles), Some([501_000.0, 4_001_000.0, 0.0]));
        // Almost as wide as the key range: only the exact middle works.
        let wide = [TileIndex::new(1_000, 0, 0), TileIndex::new(1_654, 0, 0)];
        assert_eq!(origin_for(&grid, &wide), Some([13_275.0, 0.0, 0.0]));
        let too_wide = [TileIndex::new(0, 0, 0), TileIndex::new(656, 0, 0)];
        assert_eq!(origin_for(&grid, &too_wide), None);
        assert_eq!(origin_for(&grid, &[]), None);
    }
}
