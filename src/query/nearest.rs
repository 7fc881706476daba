use super::region::{bricks_in, tiles_in, voxels_around};
use super::{Hit, Occupancy};
use crate::error::{Error, Result};
use crate::mapper::MapView;
use crate::space::{Aabb, BRICK_EDGE, Grid, Point, TileIndex, VoxelBox};

/// Radii of the balls that are searched before the whole one, in edges of a brick and of a tile.
const NEAR_BRICKS: [f64; 2] = [0.5, 2.0];
const NEAR_TILES: [f64; 2] = [1.0, 4.0];

pub(super) fn nearest_occupied<V: MapView + ?Sized>(
    view: &V,
    point: Point,
    max_distance_m: f64,
) -> Result<Option<Hit>> {
    check(point, max_distance_m)?;
    // Small balls first: what is near is found without a look at the rest of the map.
    let grid = &view.config().grid;
    let brick_m = f64::from(BRICK_EDGE) * grid.resolution_m();
    let radii_m = NEAR_BRICKS.map(|bricks| bricks * brick_m).into_iter();
    for radius_m in radii_m.chain(NEAR_TILES.map(|tiles| tiles * grid.tile_size_m())) {
        if radius_m < max_distance_m
            && let Some(nearest) = nearest_in_ball(view, point, radius_m)?
        {
            return Ok(Some(nearest));
        }
    }
    nearest_in_ball(view, point, max_distance_m)
}

/// # Errors
///
/// [`Error::InvalidArgument`] for a point that is not finite, and for a wrong distance.
pub(super) fn check(point: Point, max_distance_m: f64) -> Result<()> {
    if max_distance_m >= 0.0 && point.iter().all(|coordinate| coordinate.is_finite()) {
        return Ok(());
    }
    Err(Error::argument("nearest occupied", "needs a finite point and a distance of at least 0 m"))
}

fn nearest_in_ball<V: MapView + ?Sized>(view: &V, point: Point, max_distance_m: f64) -> Result<Option<Hit>> {
    let config = view.config();
    let (grid, threshold) = (config.grid, config.occupied_log_odds());
    let ball = |radius_m: f64| Aabb { min: point.map(|c| c - radius_m), max: point.map(|c| c + radius_m) };
    let mut tiles: Vec<(f64, TileIndex)> = tiles_in(view, &voxels_around(&grid, &ball(max_distance_m)))
        .into_iter()
        .map(|index| (distance_to_voxels_m(&grid, &grid.voxels_of_tile(index), point), index))
        .collect();
    tiles.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut best: Option<Hit> = None;
    for (distance_m, index) in tiles {
        let limit_m = best.map_or(max_distance_m, |best| best.distance_m);
        if distance_m > limit_m {
            break;
        }
        let Some(tile) = view.tile(index)? else { continue };
        for brick in bricks_in(&tile, &voxels_around(&grid, &ball(limit_m))) {
            let limit_m = best.map_or(max_distance_m, |best| best.distance_m);
            if distance_to_voxels_m(&grid, &brick.voxels, point) > limit_m {
                continue;
            }
            for voxel in brick.voxels_from(&tile, threshold) {
                let hit = Hit::from(&grid, point, voxel.index, None);
                if hit.distance_m <= max_distance_m && hit.is_nearer_than(best.as_ref()) {
                    // The probability of one that is not the nearest is never looked at, and costs little here.
                    let probability = Occupancy::of(config, Some(voxel.evidence)).probability();
                    best = Some(Hit { probability, ..hit });
                }
            }
        }
    }
    Ok(best)
}

/// A distance from which on there may be voxels of a box.
fn distance_to_voxels_m(grid: &Grid, voxels: &VoxelBox, point: Point) -> f64 {
    // A margin of a voxel for the rounding between voxel borders and multiples of the resolution.
    let bounds = Aabb {
        min: voxels.min.map(|k| (f64::from(k) - 1.0) * grid.resolution_m()),
        max: voxels.end.map(|k| (f64::from(k) + 1.0) * grid.resolution_m()),
    };
    bounds.distance_squared(point).sqrt()
}
