use super::region::{tiles_in, voxels_around, voxels_in};
use super::{Hit, Occupancy};
use crate::error::{Error, Result};
use crate::mapper::MapView;
use crate::space::{Aabb, Point, TileIndex};

/// Radii of the balls that are searched before the whole one, in edges of a tile.
const NEAR_TILES: [f64; 2] = [1.0, 4.0];

pub(super) fn nearest_occupied<V: MapView + ?Sized>(
    view: &V,
    point: Point,
    max_distance_m: f64,
) -> Result<Option<Hit>> {
    check(point, max_distance_m)?;
    // Small balls first: what is near is found without a look at the rest of the map.
    for tiles in NEAR_TILES {
        let radius_m = tiles * view.config().grid.tile_size_m();
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
        .map(|index| (distance_to_tile_m(&grid, index, point), index))
        .collect();
    tiles.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut best: Option<Hit> = None;
    for (distance_m, index) in tiles {
        let limit_m = best.map_or(max_distance_m, |best| best.distance_m);
        if distance_m > limit_m {
            break;
        }
        let Some(tile) = view.tile(index)? else { continue };
        for voxel in voxels_in(&tile, &voxels_around(&grid, &ball(limit_m))) {
            if voxel.evidence.log_odds < threshold {
                continue;
            }
            let hit = Hit::from(&grid, point, voxel.index, None);
            if hit.distance_m <= max_distance_m && hit.is_nearer_than(best.as_ref()) {
                // The probability of one that is not the nearest is never looked at, and costs little here.
                let probability = Occupancy::of(config, Some(voxel.evidence)).probability();
                best = Some(Hit { probability, ..hit });
            }
        }
    }
    Ok(best)
}

fn distance_to_tile_m(grid: &crate::space::Grid, index: TileIndex, point: Point) -> f64 {
    let voxels = grid.voxels_of_tile(index);
    // A margin of a voxel for the rounding between voxel borders and multiples of the resolution.
    let bounds = Aabb {
        min: voxels.min.map(|k| (f64::from(k) - 1.0) * grid.resolution_m()),
        max: voxels.end.map(|k| (f64::from(k) + 1.0) * grid.resolution_m()),
    };
    bounds.distance_squared(point).sqrt()
}
