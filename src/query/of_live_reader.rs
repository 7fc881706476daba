//! Queries of a map during its mapping, each as of one scan.

use super::{Hit, Occupancy, Queries, RayQuery, Shape, UnknownAs, Voxels};
use crate::error::{Error, Result};
use crate::mapper::{LiveReader, LiveView, MapView};
use crate::space::{Aabb, Grid, Point, VoxelIndex};

/// Number of attempts when the view of a query expires.
const ATTEMPTS: usize = 8;

/// Runs a query on a view of the latest scan, and again on a later one if the view expires.
fn query_view<A>(reader: &LiveReader, query: impl Fn(&LiveView) -> Result<A>) -> Result<A> {
    let mut answer = query(&reader.view());
    for _ in 1..ATTEMPTS {
        if !matches!(answer, Err(Error::Expired)) {
            break;
        }
        answer = query(&reader.view());
    }
    answer
}

/// Each query sees the map after the latest scan.
impl Queries for LiveReader {
    fn grid(&self) -> Grid {
        self.config().grid
    }

    fn occupancy(&self, voxel: VoxelIndex) -> Result<Occupancy> {
        query_view(self, |view| Ok(Occupancy::of(view.config(), view.evidence(voxel)?)))
    }

    /// All voxels are of one scan and are collected in memory, so use a box of moderate size.
    fn voxels_in(&self, region: &Aabb) -> Voxels<'_> {
        match query_view(self, |view| view.voxels_in(region).collect::<Result<Vec<_>>>()) {
            Ok(voxels) => Box::new(voxels.into_iter().map(Ok)),
            Err(error) => Box::new(std::iter::once(Err(error))),
        }
    }

    fn cast_ray(&self, ray: &RayQuery) -> Result<Option<Hit>> {
        query_view(self, |view| view.cast_ray(ray))
    }

    fn cast_segment(&self, from: Point, to: Point, unknown: UnknownAs) -> Result<Option<Hit>> {
        query_view(self, |view| view.cast_segment(from, to, unknown))
    }

    fn collision(&self, body: &Shape, unknown: UnknownAs) -> Result<Option<Hit>> {
        query_view(self, |view| view.collision(body, unknown))
    }

    fn nearest_occupied(&self, point: Point, max_distance_m: f64) -> Result<Option<Hit>> {
        query_view(self, |view| view.nearest_occupied(point, max_distance_m))
    }

    fn occupancy_at_points(&self, points: &[Point]) -> Result<Vec<Occupancy>> {
        query_view(self, |view| view.occupancy_at_points(points))
    }

    fn cast_rays(&self, rays: &[RayQuery]) -> Result<Vec<Option<Hit>>> {
        query_view(self, |view| view.cast_rays(rays))
    }
}
