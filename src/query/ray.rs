use super::tile_cursor::{Found, TileCursor};
use super::{Hit, Occupancy, UnknownAs};
use crate::error::{Error, Result};
use crate::mapper::MapView;
use crate::scan::{MAX_RAY_STEPS, RayWalk};
use crate::space::{BRICK_EDGE, Grid, Point, VoxelBox, VoxelIndex};

/// A ray to be cast through the map.
///
/// ```
/// use voxtile::{InMemoryMapper, MapConfig, Mapper, Queries, RayQuery, Scan, UnknownAs};
///
/// # fn main() -> voxtile::Result<()> {
/// let mut map = InMemoryMapper::new(MapConfig::new(0.5, 10.0)?)?;
/// map.insert_scan(&Scan { origin: [0.25; 3], points: vec![[4.25, 0.25, 0.25]], intensities: None })?;
/// let (origin, direction) = ([0.25; 3], [1.0, 0.0, 0.0]);
/// let ray = RayQuery { origin, direction, max_range_m: Some(50.0), unknown: UnknownAs::Free };
/// assert_eq!(map.cast_ray(&ray)?.map(|hit| hit.distance_m), Some(3.75));
/// # Ok(())
/// # }
/// ```
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

/// What a ray meets in a voxel.
pub(crate) enum Met {
    /// Something that stops it, with the probability of being occupied; `None` for the unknown.
    Obstacle(Option<f64>),
    /// Nothing that stops it.
    Free,
    /// Nothing that stops it in this box around the voxel.
    Empty(VoxelBox),
}

/// All voxels.
pub(crate) const EVERYWHERE: VoxelBox = VoxelBox { min: [i32::MIN; 3], end: [i32::MAX; 3] };

/// Walks a ray until it is stopped. Outside the hull everything is unknown; there is no hull around nothing.
///
/// # Errors
///
/// An origin without a voxel, a direction without a length, a wrong range; errors of `meet`.
pub(crate) fn walk_ray(
    grid: &Grid,
    query: &RayQuery,
    hull: Option<VoxelBox>,
    mut meet: impl FnMut(VoxelIndex) -> Result<Met>,
) -> Result<Option<Hit>> {
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
    let enters = hull.as_ref().is_some_and(|hull| match query.unknown {
        UnknownAs::Free => walk.enter(hull),
        UnknownAs::Obstacle => hull.contains(start),
    });
    let Some(hull) = hull.filter(|_| enters) else {
        // Only the unknown at the origin can be hit.
        let blocked = query.unknown == UnknownAs::Obstacle;
        let hit = Hit { voxel: start, center_m: grid.center_m(start), distance_m: 0.0, probability: None };
        return Ok(blocked.then_some(hit));
    };
    let range_m = query.max_range_m.unwrap_or(f64::INFINITY);
    while walk.entry_time() <= range_m {
        let voxel = walk.voxel();
        match meet(voxel)? {
            Met::Obstacle(probability) => {
                let (center_m, distance_m) = (grid.center_m(voxel), walk.entry_time());
                return Ok(Some(Hit { voxel, center_m, distance_m, probability }));
            }
            Met::Free => walk.advance(),
            Met::Empty(empty) => walk.leave(&empty),
        }
        let is_over = query.unknown == UnknownAs::Free && !hull.contains(walk.voxel());
        if is_over || walk.voxel() == voxel {
            // Beyond the map, or at the end of all voxels.
            return Ok(None);
        }
    }
    Ok(None)
}

/// Walks from one point to another, both ends included, until it is stopped.
///
/// # Errors
///
/// An end without a voxel, a segment through more than a million voxels; errors of `meet`.
pub(crate) fn walk_segment(
    grid: &Grid,
    [from, to]: [Point; 2],
    mut meet: impl FnMut(VoxelIndex) -> Result<Met>,
) -> Result<Option<Hit>> {
    let (Some(start), Some(last)) = (grid.voxel_of(from), grid.voxel_of(to)) else {
        let reason = format!("{from:?} to {to:?} m is not finite or too far away for voxel indices");
        return Err(Error::argument("segment", reason));
    };
    let mut walk = RayWalk::between(grid.to_voxel_units(from), start, grid.to_voxel_units(to), last);
    if walk.steps() > MAX_RAY_STEPS {
        let reason = format!("meets {} voxels; ask for at most {MAX_RAY_STEPS}", walk.steps());
        return Err(Error::argument("segment", reason));
    }
    let length_m = (0..3).map(|k| (to[k] - from[k]).powi(2)).sum::<f64>().sqrt();
    loop {
        let voxel = walk.voxel();
        match meet(voxel)? {
            Met::Obstacle(probability) => {
                let (center_m, distance_m) = (grid.center_m(voxel), walk.entry_time() * length_m);
                return Ok(Some(Hit { voxel, center_m, distance_m, probability }));
            }
            _ if walk.is_at_end() => return Ok(None),
            Met::Free => walk.advance(),
            Met::Empty(empty) => walk.leave(&empty),
        }
    }
}

pub(super) fn cast_ray<V: MapView + ?Sized>(view: &V, query: &RayQuery) -> Result<Option<Hit>> {
    walk_ray(&view.config().grid, query, hull_of_map(view), meet_map(view, query.unknown))
}

pub(super) fn cast_segment<V: MapView + ?Sized>(
    view: &V,
    ends: [Point; 2],
    unknown: UnknownAs,
) -> Result<Option<Hit>> {
    walk_segment(&view.config().grid, ends, meet_map(view, unknown))
}

/// What a ray meets in the voxels of a map.
fn meet_map<V: MapView + ?Sized>(view: &V, unknown: UnknownAs) -> impl FnMut(VoxelIndex) -> Result<Met> {
    let config = view.config();
    let occupied_from = config.occupied_log_odds();
    let mut tiles = TileCursor::new(view);
    move |voxel| {
        let (log_odds, empty) = match tiles.find(voxel)? {
            Found::NothingIn(empty) => (None, Some(empty)),
            Found::InBrick(evidence) => (evidence.map(|evidence| evidence.log_odds), None),
        };
        let stops = match log_odds {
            None => unknown == UnknownAs::Obstacle,
            Some(log_odds) => log_odds >= occupied_from,
        };
        Ok(match empty {
            // The probability is computed for the answer alone.
            _ if stops => Met::Obstacle(Occupancy::of_log_odds(config, log_odds).probability()),
            Some(empty) => Met::Empty(empty),
            None => Met::Free,
        })
    }
}

/// The same direction, scaled if its squares would overflow or underflow.
fn of_usable_size(direction: Point) -> Point {
    let longest = direction.iter().fold(0.0, |longest: f64, d| longest.max(d.abs()));
    let is_usable = (1e-100..1e100).contains(&longest) || !(longest.is_finite() && longest > 0.0);
    if is_usable { direction } else { direction.map(|d| d / longest) }
}

/// The voxels of a box around all tiles; `None` for an empty map.
fn hull_of_map<V: MapView + ?Sized>(view: &V) -> Option<VoxelBox> {
    let bounds = view.tile_bounds()?;
    let grid = &view.config().grid;
    let [low, high] = [bounds.min(), bounds.max()].map(|corner| grid.voxels_of_tile(corner));
    Some(VoxelBox { min: low.min, end: high.end })
}

/// The voxels of the brick that holds a voxel.
pub(crate) fn brick_of(voxel: VoxelIndex) -> VoxelBox {
    let min = voxel.map(|k| k & !(BRICK_EDGE - 1));
    VoxelBox { min, end: min.map(|k| k.saturating_add(BRICK_EDGE)) }
}
