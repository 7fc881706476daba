use super::{
    Columns, Digest, Occupancy, OctreeExport, coarse, columns, digest, merged, octree_blocks, point, region,
};
use crate::error::{Error, Result};
use crate::mapper::MapView;
use crate::octree::Octree;
use crate::sensor::Evidence;
use crate::space::{Aabb, Point};
use crate::tile::Voxel;
use std::io::{self, Read, Seek, Write};

/// What can be asked of a map of tiles beyond [`Queries`](super::Queries): exact evidence, coarse nodes, the whole map.
///
/// A query fails only if a tile cannot be read, or if a tile that has to go for it cannot be written.
pub trait MapQueries: MapView + Sized {
    /// The observed voxel that holds a point, with its exact evidence.
    ///
    /// # Errors
    ///
    /// A tile that cannot be read; for a mapper, one that has to go for it and cannot be written.
    #[inline]
    fn voxel_at(&self, point: Point) -> Result<Option<Voxel>> {
        point::voxel_at(self, point)
    }

    /// The exact evidence at many points, in their order, on all cores: each tile is looked at once or a few times.
    ///
    /// # Errors
    ///
    /// As for [`MapQueries::voxel_at`].
    fn evidence_at_points(&self, points: &[Point]) -> Result<Vec<Option<Evidence>>> {
        point::evidence_at_points(self, points)
    }

    /// The occupancy of the octree node at `depth` that holds a point: the largest log-odds under the node as `f32`,
    /// OctoMap's precision. Depth 1 is half of OctoMap's space, depth 15 two voxels wide. At depth 16 the node is the
    /// voxel, and the answer is bit-identical to [`Queries::occupancy_at`](super::Queries::occupancy_at).
    ///
    /// # Errors
    ///
    /// Another depth.
    fn occupancy_at_depth(&self, point: Point, depth: u8) -> Result<Occupancy> {
        coarse::occupancy_at_depth(self, point, depth)
    }

    /// The observed voxels whose center is in the half-open box, with their exact evidence: tile by tile, in Morton
    /// order within each. A tile is read when its first voxel is taken.
    fn evidence_in(&self, region: &Aabb) -> impl Iterator<Item = Result<Voxel>> + '_ {
        region::evidence_in(self, region)
    }

    /// Visits the observed voxels whose center is in the half-open box, in the order of [`MapQueries::evidence_in`].
    ///
    /// # Errors
    ///
    /// A tile that cannot be read; for a mapper, one that has to go for it and cannot be written.
    fn for_each_voxel_in(&self, region: &Aabb, visit: impl FnMut(Voxel)) -> Result<()> {
        region::for_each_voxel_in(self, region, visit)
    }

    /// Visits the voxels of the whole map, or of a region, whose probability of being occupied is at least
    /// `min_probability`; `None` takes the map's occupancy threshold.
    ///
    /// # Errors
    ///
    /// A tile that cannot be read.
    fn for_each_occupied(
        &self,
        min_probability: Option<f64>,
        region: Option<&Aabb>,
        visit: impl FnMut(Voxel),
    ) -> Result<()> {
        region::for_each_occupied(self, min_probability, region, visit)
    }

    /// What is known of each column of voxels whose center is in the half-open box, for robots that drive. Voxels count
    /// that reach between two heights in metres; the answer is the least rectangle around the observed ones of the box.
    ///
    /// # Errors
    ///
    /// A tile that cannot be read; more than 2^31 columns.
    fn columns_in(&self, region: &Aabb, heights_m: [f64; 2]) -> Result<Columns> {
        columns::columns_in(self, region, heights_m)
    }

    /// The occupied voxels of the whole map. For large maps use [`MapQueries::for_each_occupied`].
    ///
    /// # Errors
    ///
    /// A tile that cannot be read.
    fn all_occupied_voxels(&self, min_probability: Option<f64>) -> Result<Vec<Voxel>> {
        let mut voxels = Vec::new();
        self.for_each_occupied(min_probability, None, |voxel| voxels.push(voxel))?;
        Ok(voxels)
    }

    /// The occupied voxels of tiles in memory only; the answer depends on the cache.
    ///
    /// # Errors
    ///
    /// None for what is in memory; the tile that another thread evicts meanwhile is read again.
    fn cached_occupied_voxels(&self, min_probability: Option<f64>) -> Result<Vec<Voxel>> {
        region::cached_occupied_voxels(self, min_probability)
    }

    /// The digest of the map's content: equal for equal maps, however they were built. See `docs/format.md`.
    ///
    /// # Errors
    ///
    /// A tile that cannot be read.
    fn digest(&self) -> Result<Digest> {
        digest::digest(self)
    }

    /// One octree of the whole map or of a region, as in OctoMap, in memory. For larger maps use
    /// [`MapQueries::write_octree`].
    ///
    /// # Errors
    ///
    /// Voxels outside OctoMap's key range of 65536 voxels per axis around the origin; more than `max_voxels`.
    fn merged_octree(&self, region: Option<&Aabb>, max_voxels: u64) -> Result<Octree> {
        merged::merged_octree(self, region, max_voxels)
    }

    /// Writes the `.bt` or `.ot` file of [`MapQueries::merged_octree`]'s tree without building the tree, whatever its
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

impl<V: MapView> MapQueries for V {}
