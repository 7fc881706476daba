//! Queries of many points, rays and boxes. Results are lists in the order of the input.

use crate::arrays::{PointSlice, doubles};
use crate::errors::wrong;
use crate::source::{Source, View};
use pyo3::prelude::*;
use voxtile::mapper::MapView;
use voxtile::space::VoxelBox;
use voxtile::{
    Aabb, Error, Evidence, Hit, MapQueries, Point, Queries, RayQuery, Result, Shape, Stop, UnknownAs,
};

/// Points per query before the next check for a stop.
const POINTS_AT_A_TIME: usize = 1 << 20;
/// Rays per query: fewer, because each may cross a million voxels.
const RAYS_AT_A_TIME: usize = 1 << 14;
/// Upper bound on the size of a dense array in bytes.
const MAX_DENSE_BYTES: u64 = 1 << 32;

/// Parses boxes of an array of N x 6 or N x 2 x 3: lower and upper corner, in metres.
pub fn bodies_of(boxes: &Bound<'_, PyAny>) -> PyResult<Vec<Shape>> {
    let (shape, corners) = doubles("boxes", boxes)?;
    if !matches!(shape[..], [_, 6] | [_, 2, 3] | [0]) {
        let reason = format!("must be an array of N x 6 or N x 2 x 3, not of {shape:?}");
        return Err(wrong(boxes.py(), "boxes", reason));
    }
    let body =
        |&[x0, y0, z0, x1, y1, z1]: &[f64; 6]| Shape::Box(Aabb { min: [x0, y0, z0], max: [x1, y1, z1] });
    Ok(corners.as_chunks().0.iter().map(body).collect())
}

/// Returns the exact evidence at each point, converted by `of`.
pub fn evidences<T>(
    source: &Source,
    stop: &Stop,
    points: PointSlice<'_>,
    of: impl Fn(Option<Evidence>) -> T,
) -> Result<Vec<T>> {
    source.ask(stop, |map| {
        let mut answers = Vec::with_capacity(points.len());
        points.in_chunks(POINTS_AT_A_TIME, |chunk| {
            stop.check()?;
            answers.extend(map.evidence_at_points(chunk)?.into_iter().map(&of));
            Ok::<(), Error>(())
        })?;
        Ok(answers)
    })
}

/// Returns the first hit of each ray.
pub fn rays(source: &Source, stop: &Stop, rays: &[RayQuery]) -> Result<Vec<Option<Hit>>> {
    source.ask(stop, |map| {
        let mut hits = Vec::with_capacity(rays.len());
        for chunk in rays.chunks(RAYS_AT_A_TIME) {
            stop.check()?;
            hits.extend(map.cast_rays(chunk)?);
        }
        Ok(hits)
    })
}

/// Returns the occupied voxel nearest to each point.
pub fn nearest(
    source: &Source,
    stop: &Stop,
    points: &[Point],
    max_distance_m: f64,
) -> Result<Vec<Option<Hit>>> {
    source.ask(stop, |map| {
        let mut hits = Vec::with_capacity(points.len());
        for &point in points {
            stop.check()?;
            hits.push(map.nearest_occupied(point, max_distance_m)?);
        }
        Ok(hits)
    })
}

/// Returns whether each body touches an occupied voxel.
pub fn collisions(source: &Source, stop: &Stop, bodies: &[Shape], unknown: UnknownAs) -> Result<Vec<bool>> {
    source.ask(stop, |map| {
        let mut collide = Vec::with_capacity(bodies.len());
        for body in bodies {
            stop.check()?;
            collide.push(map.collision(body, unknown)?.is_some());
        }
        Ok(collide)
    })
}

/// Returns centers in metres and probabilities of occupied voxels, tile by tile.
pub fn occupied(map: &View<'_>, region: Option<&Aabb>, least: Option<f64>) -> Result<(Vec<Point>, Vec<f32>)> {
    let grid = map.config().grid;
    let (mut centers, mut probabilities) = (Vec::new(), Vec::new());
    map.for_each_occupied(least, region, |voxel| {
        centers.push(grid.center_m(voxel.index));
        probabilities.push(voxel.evidence.probability() as f32);
    })?;
    Ok((centers, probabilities))
}

/// Returns the box of a region in voxels, and a value per voxel in row-major order: z varies fastest.
pub fn dense<T: Clone>(
    map: &View<'_>,
    region: &Aabb,
    unknown: T,
    of: impl Fn(Evidence) -> T,
) -> Result<(VoxelBox, Vec<T>)> {
    let voxels = map.config().grid.voxels_in(region);
    let edges: [u64; 3] =
        std::array::from_fn(|k| (i64::from(voxels.end[k]) - i64::from(voxels.min[k])).max(0) as u64);
    let mut values = array_of(edges, unknown)?;
    map.for_each_voxel_in(region, |voxel| {
        let [x, y, z]: [usize; 3] =
            std::array::from_fn(|k| (i64::from(voxel.index[k]) - i64::from(voxels.min[k])) as usize);
        values[(x * edges[1] as usize + y) * edges[2] as usize + z] = of(voxel.evidence);
    })?;
    Ok((voxels, values))
}

/// Allocates an array filled with one value. Returns an error if memory is short: a failed allocation would end the
/// process.
fn array_of<T: Clone>(edges: [u64; 3], value: T) -> Result<Vec<T>> {
    let count = edges.iter().try_fold(1_u64, |count, &edge| count.checked_mul(edge)).unwrap_or(u64::MAX);
    let bytes = count.saturating_mul(size_of::<T>() as u64);
    let too_large =
        |limit, hint| Error::TooLarge { what: "number of bytes of the array", size: bytes, limit, hint };
    if bytes > MAX_DENSE_BYTES {
        return Err(too_large(MAX_DENSE_BYTES, "choose a smaller region, or only the occupied voxels"));
    }
    let mut values = Vec::new();
    // The available memory is unknown, but smaller than the request.
    let no_memory = |_| too_large(bytes.saturating_sub(1), "memory is short: choose a smaller region");
    values.try_reserve_exact(count as usize).map_err(no_memory)?;
    values.resize(count as usize, value);
    Ok(values)
}
