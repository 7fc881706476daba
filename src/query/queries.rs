use super::collision::{self, Shape};
use super::nearest::{self, Nearest};
use super::ray::{self, RayHit, RayQuery};
use super::{Occupancy, OctreeExport, UnknownAs, coarse, digest, merged, octree_blocks, point, region};
use crate::error::{Error, Result};
use crate::mapper::MapView;
use crate::octree::Octree;
use crate::space::{Aabb, Point, VoxelIndex};
use crate::tile::Voxel;
use std::io::{self, Read, Seek, Write};

/// The queries of a map; bring this trait into scope to use them.
///
/// Points are in metres in the world frame. A query fails only if a tile cannot be read, or if a tile that it evicts
/// cannot be written.
pub trait Queries: MapView + Sized {
    /// The occupancy of the voxel that holds a point; unknown for a point that is not finite.
    #[inline]
    fn occupancy_at(&self, point: Point) -> Result<Occupancy> {
        Ok(Occupancy::of(self.config(), self.voxel_at(point)?.map(|voxel| voxel.evidence)))
    }

    /// The occupancy at many points, in their order; each tile is loaded once.
    fn occupancy_at_points(&self, points: &[Point]) -> Result<Vec<Occupancy>> {
        point::occupancy_at_points(self, points)
    }

    /// The observed voxel that holds a point, with its exact evidence.
    #[inline]
    fn voxel_at(&self, point: Point) -> Result<Option<Voxel>> {
        point::voxel_at(self, point)
    }

    /// The occupancy of the octree node at `depth` that holds a point: the largest log-odds under the node as `f32`,
    /// OctoMap's precision. Depth 1 is half of OctoMap's space, depth 15 two voxels wide. At depth 16 the node is the
    /// voxel, and the answer is bit-identical to [`Queries::occupancy_at`].
    ///
    /// # Errors
    ///
    /// Another depth.
    fn occupancy_at_depth(&self, point: Point, depth: u8) -> Result<Occupancy> {
        coarse::occupancy_at_depth(self, point, depth)
    }

    /// Visits the observed voxels whose center is in the half-open box, tile by tile, in Morton order within each.
    fn for_each_voxel_in(&self, region: &Aabb, visit: impl FnMut(Voxel)) -> Result<()> {
        region::for_each_voxel_in(self, region, visit)
    }

    /// Visits the voxels of the whole map, or of a region, whose probability of being occupied is at least
    /// `min_probability`; `None` takes the map's occupancy threshold.
    fn for_each_occupied(
        &self,
        min_probability: Option<f64>,
        region: Option<&Aabb>,
        visit: impl FnMut(Voxel),
    ) -> Result<()> {
        region::for_each_occupied(self, min_probability, region, visit)
    }

    /// The occupied voxels of the whole map. For large maps use [`Queries::for_each_occupied`].
    fn all_occupied_voxels(&self, min_probability: Option<f64>) -> Result<Vec<Voxel>> {
        let mut voxels = Vec::new();
        self.for_each_occupied(min_probability, None, |voxel| voxels.push(voxel))?;
        Ok(voxels)
    }

    /// The occupied voxels of tiles in memory only; the answer depends on the cache.
    fn cached_occupied_voxels(&self, min_probability: Option<f64>) -> Result<Vec<Voxel>> {
        region::cached_occupied_voxels(self, min_probability)
    }

    /// The first occupied voxel on a ray (or the first unknown one, if that is an obstacle); `None` if the ray ends
    /// first.
    ///
    /// # Errors
    ///
    /// An origin without a voxel, a zero direction.
    fn cast_ray(&self, query: &RayQuery) -> Result<Option<RayHit>> {
        ray::cast_ray(self, query)
    }

    /// [`Queries::cast_ray`] for many rays, in their order.
    fn cast_rays(&self, queries: &[RayQuery]) -> Result<Vec<Option<RayHit>>> {
        queries.iter().map(|query| self.cast_ray(query)).collect()
    }

    /// An occupied voxel that a body touches (or an unknown one, if that is an obstacle); `None` if the body is free of
    /// collision.
    ///
    /// # Errors
    ///
    /// A body that is not finite, or so large that its voxels have no index.
    fn collision(&self, body: &Shape, unknown: UnknownAs) -> Result<Option<VoxelIndex>> {
        collision::collision(self, body, unknown)
    }

    /// The occupied voxel whose center is nearest to a point and at most `max_distance_m` away; at equal distances the
    /// one with the lowest index.
    fn nearest_occupied(&self, point: Point, max_distance_m: f64) -> Result<Option<Nearest>> {
        nearest::nearest_occupied(self, point, max_distance_m)
    }

    /// The digest of the map's content: equal for equal maps, however they were built. See `docs/format.md`.
    fn digest(&self) -> Result<blake3::Hash> {
        digest::digest(self)
    }

    /// One octree of the whole map or of a region, as in OctoMap, in memory. For larger maps use
    /// [`Queries::write_octree`].
    ///
    /// # Errors
    ///
    /// Voxels outside OctoMap's key range of 65536 voxels per axis around the origin; more than `max_voxels`.
    fn merged_octree(&self, region: Option<&Aabb>, max_voxels: u64) -> Result<Octree> {
        merged::merged_octree(self, region, max_voxels)
    }

    /// Writes the `.bt` or `.ot` file of [`Queries::merged_octree`]'s tree without building the tree, whatever its
    /// size. Returns the number of its voxels.
    ///
    /// The spool, an empty file or a [`Cursor`](std::io::Cursor), receives as many bytes as the file. `out` is written
    /// only after all tiles were read.
    ///
    /// # Errors
    ///
    /// Voxels outside OctoMap's key range; errors of the spool or of `out`.
    fn write_octree<E: From<Error> + From<io::Error>>(
        &self,
        export: &OctreeExport<'_>,
        spool: &mut (impl Read + Write + Seek),
        out: &mut impl Write,
    ) -> std::result::Result<u64, E> {
        octree_blocks::write_octree(self, export, spool, out)
    }
}

impl<V: MapView> Queries for V {}
