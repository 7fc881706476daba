//! Queries of maps of tiles.

use super::{Hit, Occupancy, Queries, RayQuery, Shape, UnknownAs, VoxelOccupancy, Voxels};
use super::{collision, nearest, point, ray, region};
use crate::error::Result;
use crate::mapper::MapView;
use crate::space::{Aabb, Grid, Point, VoxelIndex};

impl<V: MapView> Queries for V {
    #[inline]
    fn grid(&self) -> Grid {
        self.config().grid
    }

    #[inline]
    fn occupancy(&self, voxel: VoxelIndex) -> Result<Occupancy> {
        Ok(Occupancy::of(self.config(), self.evidence(voxel)?))
    }

    fn voxels_in(&self, region: &Aabb) -> Voxels<'_> {
        let config = self.config();
        let voxels = region::evidence_in(self, region).map(|voxel| {
            let voxel = voxel?;
            let occupancy = Occupancy::of(config, Some(voxel.evidence));
            Ok(VoxelOccupancy { voxel: voxel.index, occupancy })
        });
        Box::new(voxels)
    }

    fn cast_ray(&self, ray: &RayQuery) -> Result<Option<Hit>> {
        ray::cast_ray(self, ray)
    }

    fn cast_segment(&self, from: Point, to: Point, unknown: UnknownAs) -> Result<Option<Hit>> {
        ray::cast_segment(self, [from, to], unknown)
    }

    fn collision(&self, body: &Shape, unknown: UnknownAs) -> Result<Option<Hit>> {
        collision::collision(self, body, unknown)
    }

    fn nearest_occupied(&self, point: Point, max_distance_m: f64) -> Result<Option<Hit>> {
        nearest::nearest_occupied(self, point, max_distance_m)
    }

    fn occupancy_at_points(&self, points: &[Point]) -> Result<Vec<Occupancy>> {
        point::occupancy_at_points(self, points)
    }
}
