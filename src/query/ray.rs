use super::tile_cursor::TileCursor;
use super::{Occupancy, UnknownAs};
use crate::error::{Error, Result};
use crate::mapper::MapView;
use crate::scan::RayWalk;
use crate::space::{BRICK_EDGE, BrickCode, Point, VoxelBox, VoxelIndex};
use serde::Serialize;

/// A ray to be cast through the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayQuery {
    /// Where the ray begins, in metres.
    pub origin: Point,
    /// Where it goes; any length but 0.
    pub direction: Point,
    /// How far it goes, in metres; `None` as far as the map reaches.
    pub max_range_m: Option<f64>,
    /// Whether unknown space stops the ray.
    pub unknown: UnknownAs,
}

/// Where a ray ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RayHit {
    /// The voxel that stopped the ray.
    pub voxel: VoxelIndex,
    /// Its center in metres.
    pub center_m: Point,
    /// How far from the origin the ray enters it, in metres; 0 if the ray begins in it.
    pub distance_m: f64,
    /// Probability of being occupied; `None` if the voxel is unknown.
    pub probability: Option<f64>,
}

pub(super) fn cast_ray(view: &impl MapView, query: &RayQuery) -> Result<Option<RayHit>> {
    let config = view.config();
    let grid = &config.grid;
    let (origin, direction) = (query.origin, of_usable_size(query.direction));
    let start = grid
        .voxel_of(origin)
        .ok_or_else(|| Error::argument("origin", format!("{origin:?} m is not finite or too far away")))?;
    let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
    if !(length.is_normal() && direction.iter().all(|d| d.is_finite())) {
        return Err(Error::argument("direction", format!("{direction:?} has no usable length")));
    }
    if query.max_range_m.is_some_and(|range| range.is_nan() || range < 0.0) {
        return Err(Error::argument("max range", "must be a length of at least 0 m"));
    }
    let mut walk = RayWalk::along(
        grid.to_voxel_units(origin),
        start,
        grid.to_voxel_units(direction.map(|d| d / length)), // Times come out in metres.
    );
    // Outside the box around all tiles everything is unknown.
    let hull = hull_of_map(view);
    let enters = hull.as_ref().is_some_and(|hull| match query.unknown {
        UnknownAs::Free => walk.enter(hull),
        UnknownAs::Obstacle => hull.contains(start),
    });
    let Some(hull) = hull.filter(|_| enters) else {
        // Only the unknown at the origin can be hit.
        let blocked = query.unknown == UnknownAs::Obstacle;
        let hit = RayHit { voxel: start, center_m: grid.center_m(start), distance_m: 0.0, probability: None };
        return Ok(blocked.then_some(hit));
    };
    let range_m = query.max_range_m.unwrap_or(f64::INFINITY);
    let occupied_from = config.occupied_log_odds();
    let mut tiles = TileCursor::new(view);
    while walk.entry_time() <= range_m {
        let voxel = walk.voxel();
        let tile = tiles.tile_of(voxel)?;
        let log_odds = tile.and_then(|tile| tile.evidence(voxel)).map(|evidence| evidence.log_odds);
        let stops = match log_odds {
            None => query.unknown == UnknownAs::Obstacle,
            Some(log_odds) => log_odds >= occupied_from,
        };
        if stops {
            // The probability is computed for the answer alone.
            let occupancy = Occupancy::of_log_odds(config, log_odds);
            let (center_m, distance_m) = (grid.center_m(voxel), walk.entry_time());
            return Ok(Some(RayHit { voxel, center_m, distance_m, probability: occupancy.probability() }));
        }
        match tile {
            None => walk.leave(&grid.voxels_of_tile(grid.tile_of_voxel(voxel))),
            Some(tile) if !tile.table().has_brick(BrickCode::of_voxel(voxel)) => {
                walk.leave(&brick_of(voxel).intersection(&tile.voxel_box()));
            }
            Some(_) => walk.advance(),
        }
        let is_over = query.unknown == UnknownAs::Free && !hull.contains(walk.voxel());
        if is_over || walk.voxel() == voxel {
            // Beyond the map, or at the end of all voxels.
            return Ok(None);
        }
    }
    Ok(None)
}

/// The same direction, scaled if its squares would overflow or underflow.
fn of_usable_size(direction: Point) -> Point {
    let longest = direction.iter().fold(0.0, |longest: f64, d| longest.max(d.abs()));
    let is_usable = (1e-100..1e100).contains(&longest) || !(longest.is_finite() && longest > 0.0);
    if is_usable { direction } else { direction.map(|d| d / longest) }
}

/// The voxels of a box around all tiles; `None` for an empty map.
fn hull_of_map(view: &impl MapView) -> Option<VoxelBox> {
    let bounds = view.tile_bounds()?;
    let grid = &view.config().grid;
    let [low, high] = [bounds.min(), bounds.max()].map(|corner| grid.voxels_of_tile(corner));
    Some(VoxelBox { min: low.min, end: high.end })
}

fn brick_of(voxel: VoxelIndex) -> VoxelBox {
    let min = voxel.map(|k| k & !(BRICK_EDGE - 1));
    VoxelBox { min, end: min.map(|k| k.saturating_add(BRICK_EDGE)) }
}
