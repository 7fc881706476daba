//! Queries of sets of occupied voxels; all other voxels are unknown.
//!
//! A crate implements [`OccupiedSet`] for its set and invokes
//! [`answer_as_occupied_set`](crate::answer_as_occupied_set). The set then implements [`Queries`](crate::Queries) like
//! a map.

use super::collision::first_not_free;
use super::ray::{Met, walk_ray, walk_segment};
use super::region::voxels_around;
use super::{Hit, Occupancy, RayQuery, Shape, UnknownAs, VoxelOccupancy};
use crate::error::{Error, Result};
use crate::scan::RayWalk;
use crate::space::{Aabb, Grid, Point, VoxelBox, VoxelIndex};

/// Probability that is reported for occupied voxels.
const OCCUPIED: f64 = 1.0;

/// Set of occupied voxels; all others are unknown.
pub trait OccupiedSet: Sync {
    /// Grid of voxels and tiles.
    fn grid_of_set(&self) -> Grid;

    /// Returns whether a voxel is occupied.
    fn holds(&self, voxel: VoxelIndex) -> bool;

    /// Returns a box around a voxel without occupied voxels; `None` if none is known.
    fn empty_around(&self, voxel: VoxelIndex) -> Option<VoxelBox>;

    /// Boxes of equal size that together contain all occupied voxels.
    fn cells(&self) -> impl Iterator<Item = VoxelBox>;

    /// Visits the occupied voxels in a box until `visit` returns `false`.
    fn visit_in(&self, voxels: &VoxelBox, visit: &mut dyn FnMut(VoxelIndex) -> bool);
}

/// Returns the occupancy of a voxel.
pub fn occupancy(set: &impl OccupiedSet, voxel: VoxelIndex) -> Occupancy {
    if set.holds(voxel) { Occupancy::Occupied(OCCUPIED) } else { Occupancy::Unknown }
}

/// Returns the occupied voxels whose centers are in a region.
pub fn voxels_in(set: &impl OccupiedSet, region: &Aabb) -> Vec<VoxelOccupancy> {
    let (grid, mut found) = (set.grid_of_set(), Vec::new());
    set.visit_in(&voxels_around(&grid, region), &mut |voxel| {
        if region.contains(grid.center_m(voxel)) {
            found.push(VoxelOccupancy { voxel, occupancy: Occupancy::Occupied(OCCUPIED) });
        }
        true
    });
    found
}

/// Returns a box around all cells, and their number.
fn hull_of(set: &impl OccupiedSet) -> (Option<VoxelBox>, usize) {
    let mut count = 0;
    let cells = set.cells().inspect(|_| count += 1);
    let hull = cells.reduce(|a, b| VoxelBox {
        min: std::array::from_fn(|k| a.min[k].min(b.min[k])),
        end: std::array::from_fn(|k| a.end[k].max(b.end[k])),
    });
    (hull, count)
}

/// Returns the function by which [`walk_ray`] examines the next voxels of a ray. `cells` is the number of cells of the
/// set.
fn meet(
    set: &impl OccupiedSet,
    unknown: UnknownAs,
    cells: usize,
) -> impl FnMut(&mut RayWalk, f64) -> Result<Met> {
    let mut empty_in_a_row = 0;
    move |walk, _| {
        let voxel = walk.voxel();
        let empty = match set.empty_around(voxel) {
            _ if unknown == UnknownAs::Obstacle => {
                return Ok(Met::Obstacle(occupancy(set, voxel).probability()));
            }
            None if set.holds(voxel) => return Ok(Met::Obstacle(Some(OCCUPIED))),
            None => {
                empty_in_a_row = 0;
                return Ok(Met::Free);
            }
            Some(empty) => empty,
        };
        empty_in_a_row += 1;
        if empty_in_a_row <= cells {
            return Ok(Met::Empty(empty));
        }
        // Scanning all cells now costs no more than the steps so far, however distant the next cell is.
        empty_in_a_row = 0;
        walk.leave(&empty);
        let ahead = set.cells().filter_map(|cell| {
            let mut ahead = walk.clone();
            ahead.enter(&cell).then_some(ahead)
        });
        Ok(match ahead.min_by_key(|ahead| walk.steps_to(ahead.voxel())) {
            Some(ahead) => {
                *walk = ahead;
                Met::Passed
            }
            None => Met::End,
        })
    }
}

/// Returns the first occupied voxel on a ray.
///
/// # Errors
///
/// Fails if the ray has no direction or is not finite.
pub fn cast_ray(set: &impl OccupiedSet, query: &RayQuery) -> Result<Option<Hit>> {
    let (hull, cells) = hull_of(set);
    walk_ray(&set.grid_of_set(), query, hull, meet(set, query.unknown, cells))
}

/// Returns the first occupied voxel between two points.
///
/// # Errors
///
/// Fails if the segment is not finite or too long.
pub fn cast_segment(set: &impl OccupiedSet, ends: [Point; 2], unknown: UnknownAs) -> Result<Option<Hit>> {
    // Never scan all cells: a segment crosses at most a million voxels.
    walk_segment(&set.grid_of_set(), ends, meet(set, unknown, usize::MAX))
}

/// Returns an occupied voxel that a body touches.
///
/// # Errors
///
/// Fails if the body is not finite or too large.
pub fn collision(set: &impl OccupiedSet, body: &Shape, unknown: UnknownAs) -> Result<Option<Hit>> {
    let grid = set.grid_of_set();
    if unknown == UnknownAs::Obstacle {
        return first_not_free(&grid, body, |voxel| Ok(occupancy(set, voxel)));
    }
    let mut found = None;
    set.visit_in(&voxels_around(&grid, &body.bounds()?), &mut |voxel| {
        if body.touches_voxel(&grid, voxel) {
            found = Some(Hit::from(&grid, body.reference_point(), voxel, Some(OCCUPIED)));
        }
        found.is_none()
    });
    Ok(found)
}

/// Returns the occupied voxel with the nearest center.
///
/// # Errors
///
/// Fails if the point is not finite or the distance is invalid.
pub fn nearest_occupied(set: &impl OccupiedSet, point: Point, max_distance_m: f64) -> Result<Option<Hit>> {
    super::nearest::check(point, max_distance_m)?;
    let grid = set.grid_of_set();
    let (Some(hull), _) = hull_of(set) else { return Ok(None) };
    // All voxels are in a ball around the point that reaches the corners of the hull.
    let farthest_m = (0..3)
        .map(|k| [hull.min[k], hull.end[k]].map(|index| (grid.corner_m(index) - point[k]).abs()))
        .map(|[low, high]| low.max(high).powi(2))
        .sum::<f64>()
        .sqrt();
    let max_distance_m = max_distance_m.min(farthest_m);
    let mut best: Option<Hit> = None;
    // Small balls first: the first ball with a voxel contains the nearest one.
    let mut reach_m = grid.resolution_m() * 4.0;
    loop {
        let ball_m = reach_m.min(max_distance_m);
        let bounds = Aabb { min: point.map(|x| x - ball_m), max: point.map(|x| x + ball_m) };
        set.visit_in(&voxels_around(&grid, &bounds), &mut |voxel| {
            let hit = Hit::from(&grid, point, voxel, Some(OCCUPIED));
            if hit.distance_m <= ball_m && hit.is_nearer_than(best.as_ref()) {
                best = Some(hit);
            }
            true
        });
        if best.is_some() || reach_m >= max_distance_m {
            return Ok(best);
        }
        reach_m *= 2.0;
    }
}

/// Checks that maps have voxels of the same size.
///
/// # Errors
///
/// Fails with [`Error::InvalidArgument`], which contains both sizes.
pub(crate) fn check_resolutions(resolutions_m: impl Iterator<Item = f64>) -> Result<()> {
    let mut first: Option<f64> = None;
    for resolution_m in resolutions_m {
        let first = *first.get_or_insert(resolution_m);
        if first.to_bits() != resolution_m.to_bits() {
            let reason = format!(
                "{first} m in one map, {resolution_m} m in another; all maps need the same resolution"
            );
            return Err(Error::argument("resolution", reason));
        }
    }
    Ok(())
}

/// Implements [`Queries`](crate::query::Queries) for an [`OccupiedSet`](crate::query::occupied_set::OccupiedSet).
#[macro_export]
macro_rules! answer_as_occupied_set {
    ($set:ty) => {
        impl $crate::query::Queries for $set {
            fn grid(&self) -> $crate::space::Grid {
                $crate::query::occupied_set::OccupiedSet::grid_of_set(self)
            }

            fn occupancy(
                &self,
                voxel: $crate::space::VoxelIndex,
            ) -> $crate::Result<$crate::query::Occupancy> {
                Ok($crate::query::occupied_set::occupancy(self, voxel))
            }

            fn voxels_in(&self, region: &$crate::space::Aabb) -> $crate::query::Voxels<'_> {
                Box::new($crate::query::occupied_set::voxels_in(self, region).into_iter().map(Ok))
            }

            fn cast_ray(&self, ray: &$crate::query::RayQuery) -> $crate::Result<Option<$crate::query::Hit>> {
                $crate::query::occupied_set::cast_ray(self, ray)
            }

            fn cast_segment(
                &self,
                from: $crate::space::Point,
                to: $crate::space::Point,
                unknown: $crate::query::UnknownAs,
            ) -> $crate::Result<Option<$crate::query::Hit>> {
                $crate::query::occupied_set::cast_segment(self, [from, to], unknown)
            }

            fn collision(
                &self,
                body: &$crate::query::Shape,
                unknown: $crate::query::UnknownAs,
            ) -> $crate::Result<Option<$crate::query::Hit>> {
                $crate::query::occupied_set::collision(self, body, unknown)
            }

            fn nearest_occupied(
                &self,
                point: $crate::space::Point,
                max_distance_m: f64,
            ) -> $crate::Result<Option<$crate::query::Hit>> {
                $crate::query::occupied_set::nearest_occupied(self, point, max_distance_m)
            }
        }
    };
}
