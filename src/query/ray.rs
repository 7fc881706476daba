use super::tile_cursor::{Around, TileCursor};
use super::{Hit, Occupancy, UnknownAs};
use crate::error::{Error, Result};
use crate::mapper::MapView;
use crate::scan::{Advanced, MAX_RAY_STEPS, RayWalk};
use crate::space::{BRICK_EDGE, Grid, Point, VoxelBox, VoxelIndex, place_of_voxel};

/// Ray to be cast through a map.
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
    /// Origin in metres.
    pub origin: Point,
    /// Direction; any length except 0.
    pub direction: Point,
    /// Maximum range in metres; `None` for no limit.
    pub max_range_m: Option<f64>,
    /// Whether unknown space stops the ray.
    pub unknown: UnknownAs,
}

/// Result of examining the next voxels of a ray.
pub(crate) enum Met {
    /// The voxel stops the ray; contains the probability of being occupied, `None` if unknown.
    Obstacle(Option<f64>),
    /// The voxel does not stop the ray.
    Free,
    /// No voxel of this box around the current one stops the ray.
    Empty(VoxelBox),
    /// No voxel so far stops the ray; the walk was advanced to a voxel that is not examined yet.
    Passed,
    /// No voxel up to the last one stops the ray.
    End,
}

/// Returns a function for [`walk_ray`] that examines one voxel at a time.
pub(crate) fn voxel_by_voxel(
    mut meet: impl FnMut(VoxelIndex) -> Result<Met>,
) -> impl FnMut(&mut RayWalk, f64) -> Result<Met> {
    move |walk, _| meet(walk.voxel())
}

pub(crate) const EVERYWHERE: VoxelBox = VoxelBox { min: [i32::MIN; 3], end: [i32::MAX; 3] };

/// Walks a ray until a voxel stops it. All voxels outside of `hull` are unknown; an empty map has no hull. `meet`
/// examines the next voxels: it receives the walk and the range in metres, and may advance the walk.
///
/// # Errors
///
/// Fails if the origin is outside of the map's space, the direction is zero or the range is invalid; returns errors of
/// `meet`.
pub(crate) fn walk_ray(
    grid: &Grid,
    query: &RayQuery,
    hull: Option<VoxelBox>,
    mut meet: impl FnMut(&mut RayWalk, f64) -> Result<Met>,
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
        grid.to_voxel_units(direction.map(|d| d / length)), // Times are then in metres.
    );
    let enters = hull.as_ref().is_some_and(|hull| match query.unknown {
        UnknownAs::Free => walk.enter(hull),
        UnknownAs::Obstacle => hull.contains(start),
    });
    let Some(hull) = hull.filter(|_| enters) else {
        // Only unknown space at the origin can be hit.
        let blocked = query.unknown == UnknownAs::Obstacle;
        let hit = Hit { voxel: start, center_m: grid.center_m(start), distance_m: 0.0, probability: None };
        return Ok(blocked.then_some(hit));
    };
    let range_m = query.max_range_m.unwrap_or(f64::INFINITY);
    while walk.entry_time() <= range_m {
        let before = walk.voxel();
        match meet(&mut walk, range_m)? {
            Met::Obstacle(probability) => {
                let (voxel, distance_m) = (walk.voxel(), walk.entry_time());
                return Ok(Some(Hit { voxel, center_m: grid.center_m(voxel), distance_m, probability }));
            }
            Met::Free => walk.advance(),
            Met::Empty(empty) => walk.leave(&empty),
            Met::Passed => {}
            Met::End => return Ok(None),
        }
        let is_over = query.unknown == UnknownAs::Free && !hull.contains(walk.voxel());
        if is_over || walk.voxel() == before {
            // Outside the map, or at the end of the index range.
            return Ok(None);
        }
    }
    Ok(None)
}

/// Walks from one point to another, including both ends, until a voxel stops the walk. `meet` is as for [`walk_ray`].
///
/// # Errors
///
/// Fails if an end is outside of the map's space or the segment crosses more than a million voxels; returns errors of
/// `meet`.
pub(crate) fn walk_segment(
    grid: &Grid,
    [from, to]: [Point; 2],
    mut meet: impl FnMut(&mut RayWalk, f64) -> Result<Met>,
) -> Result<Option<Hit>> {
    let (Some(start), Some(last)) = (grid.voxel_of(from), grid.voxel_of(to)) else {
        let reason = format!("{from:?} to {to:?} m is not finite or too far away for voxel indices");
        return Err(Error::argument("segment", reason));
    };
    let mut walk = RayWalk::between(grid.to_voxel_units(from), start, grid.to_voxel_units(to), last);
    if walk.steps() > MAX_RAY_STEPS {
        let reason = format!(
            "crosses {} voxels, more than the limit of {MAX_RAY_STEPS}; use a shorter one",
            walk.steps()
        );
        return Err(Error::argument("segment", reason));
    }
    let length_m = (0..3).map(|k| (to[k] - from[k]).powi(2)).sum::<f64>().sqrt();
    loop {
        match meet(&mut walk, f64::INFINITY)? {
            Met::Obstacle(probability) => {
                let (voxel, distance_m) = (walk.voxel(), walk.entry_time() * length_m);
                return Ok(Some(Hit { voxel, center_m: grid.center_m(voxel), distance_m, probability }));
            }
            Met::Passed => {}
            Met::End => return Ok(None),
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

/// Returns a function for [`walk_ray`] that examines a map brick by brick.
fn meet_map<V: MapView + ?Sized>(
    view: &V,
    unknown: UnknownAs,
) -> impl FnMut(&mut RayWalk, f64) -> Result<Met> {
    let config = view.config();
    let occupied_from = config.occupied_log_odds();
    let stops_at_unknown = unknown == UnknownAs::Obstacle;
    let mut tiles = TileCursor::new(view);
    move |walk, until| {
        if !stops_at_unknown && let Some(below) = tiles.below_around(walk.voxel(), occupied_from)? {
            return Ok(match below.end[0].saturating_sub(below.min[0]) > BRICK_EDGE {
                true => Met::Empty(below),
                // The few steps through a brick cost less than a jump.
                false => met_nothing(walk.advance_in(&below, until, |_| true)),
            });
        }
        let (brick, voxels) = match tiles.around(walk.voxel())? {
            Around::Nothing(_) if stops_at_unknown => return Ok(Met::Obstacle(None)),
            Around::Nothing(empty) => return Ok(Met::Empty(empty)),
            Around::Brick(brick, voxels) => (brick, voxels),
        };
        let mut met = None;
        let advanced = match (brick.is_below(occupied_from), stops_at_unknown) {
            (true, false) => walk.advance_in(&voxels, until, |_| true),
            (true, true) => walk.advance_in(&voxels, until, |voxel| brick.is_observed(place_of_voxel(voxel))),
            (false, _) => walk.advance_in(&voxels, until, |voxel| {
                let log_odds = brick.get(place_of_voxel(voxel)).map(|evidence| evidence.log_odds);
                let stops = log_odds.map_or(stops_at_unknown, |log_odds| log_odds >= occupied_from);
                // The probability is computed only for the result.
                met = log_odds;
                !stops
            }),
        };
        Ok(match advanced {
            Advanced::Stopped => Met::Obstacle(Occupancy::of_log_odds(config, met).probability()),
            advanced => met_nothing(advanced),
        })
    }
}

fn met_nothing(advanced: Advanced) -> Met {
    if advanced == Advanced::AtEnd { Met::End } else { Met::Passed }
}

/// Scales the direction if its squares would overflow or underflow.
fn of_usable_size(direction: Point) -> Point {
    let longest = direction.iter().fold(0.0, |longest: f64, d| longest.max(d.abs()));
    let is_usable = (1e-100..1e100).contains(&longest) || !(longest.is_finite() && longest > 0.0);
    if is_usable { direction } else { direction.map(|d| d / longest) }
}

/// The voxels of a box around all tiles; `None` for an empty map.
fn hull_of_map<V: MapView + ?Sized>(view: &V) -> Option<VoxelBox> {
    let bounds = view.tile_bounds()?;
    Some(view.config().grid.voxels_of_tiles(bounds))
}

/// The voxels of the brick that contains a voxel.
pub fn brick_of(voxel: VoxelIndex) -> VoxelBox {
    let min = voxel.map(|k| k & !(BRICK_EDGE - 1));
    VoxelBox { min, end: min.map(|k| k.saturating_add(BRICK_EDGE)) }
}
