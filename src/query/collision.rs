use super::ray::brick_of;
use super::region::{bricks_in, tiles_in, voxels_around};
use super::tile_cursor::TileCursor;
use super::{Hit, Occupancy, Shape, UnknownAs};
use crate::error::{Error, Result};
use crate::mapper::MapView;
use crate::space::{BRICK_EDGE, Grid, VoxelBox, VoxelIndex};

/// Maximum number of voxels when unknown space is an obstacle, because then each voxel is examined.
const MAX_UNKNOWN_VOXELS: u64 = 1 << 28;

pub(super) fn collision<V: MapView + ?Sized>(
    view: &V,
    body: &Shape,
    unknown: UnknownAs,
) -> Result<Option<Hit>> {
    let config = view.config();
    let grid = &config.grid;
    let around = voxels_around(grid, &body.bounds()?);
    if unknown == UnknownAs::Obstacle {
        let mut tiles = TileCursor::new(view);
        return first_not_free(grid, body, |voxel| {
            let evidence = tiles.tile_of(voxel)?.and_then(|tile| tile.evidence(voxel));
            Ok(Occupancy::of(config, evidence))
        });
    }
    let occupied_from = config.occupied_log_odds();
    for index in tiles_in(view, &around) {
        if !body.touches_voxels(grid, &grid.voxels_of_tile(index)) {
            continue;
        }
        let Some(tile) = view.tile(index)? else { continue };
        let mut touched = bricks_in(&tile, &around)
            .filter(|brick| brick.may_hold(&tile, occupied_from))
            .filter(|brick| body.touches_voxels(grid, &brick.voxels))
            .flat_map(|brick| brick.voxels_from(&tile, occupied_from))
            .filter(|voxel| body.touches_voxel(grid, voxel.index));
        if let Some(voxel) = touched.next() {
            let probability = Occupancy::of(config, Some(voxel.evidence)).probability();
            return Ok(Some(Hit::from(grid, body.reference_point(), voxel.index, probability)));
        }
    }
    Ok(None)
}

/// Returns the first voxel, brick by brick, that a body touches and that is not free according to `occupancy`. Bricks
/// that the body does not touch are skipped.
///
/// # Errors
///
/// Fails if the body is invalid or covers too many voxels; returns errors from `occupancy`.
pub(crate) fn first_not_free(
    grid: &Grid,
    body: &Shape,
    mut occupancy: impl FnMut(VoxelIndex) -> Result<Occupancy>,
) -> Result<Option<Hit>> {
    let around = voxels_around(grid, &body.bounds()?);
    let size: u64 =
        (0..3).map(|k| u64::from(around.end[k].abs_diff(around.min[k]))).fold(1, u64::saturating_mul);
    if size > MAX_UNKNOWN_VOXELS {
        let hint = "use a smaller body, or treat unknown space as free";
        return Err(Error::TooLarge {
            what: "number of voxels in the body",
            size,
            limit: MAX_UNKNOWN_VOXELS,
            hint,
        });
    }
    for brick in bricks_of(&around) {
        if !body.touches_voxels(grid, &brick) {
            continue;
        }
        for voxel in voxels_of(brick) {
            if body.touches_voxel(grid, voxel) {
                let found = occupancy(voxel)?;
                if !matches!(found, Occupancy::Free(_)) {
                    return Ok(Some(Hit::from(grid, body.reference_point(), voxel, found.probability())));
                }
            }
        }
    }
    Ok(None)
}

/// Returns the bricks that overlap a box, each clipped to the box.
fn bricks_of(voxels: &VoxelBox) -> impl Iterator<Item = VoxelBox> {
    let voxels = *voxels;
    let corners = move |k: usize| {
        let first = voxels.min[k] & !(BRICK_EDGE - 1);
        (first..voxels.end[k]).step_by(BRICK_EDGE as usize)
    };
    let corners =
        corners(0).flat_map(move |x| corners(1).flat_map(move |y| corners(2).map(move |z| [x, y, z])));
    corners.map(move |corner| brick_of(corner).intersection(&voxels))
}

fn voxels_of(VoxelBox { min, end }: VoxelBox) -> impl Iterator<Item = VoxelIndex> {
    (min[0]..end[0])
        .flat_map(move |x| (min[1]..end[1]).flat_map(move |y| (min[2]..end[2]).map(move |z| [x, y, z])))
}
