use super::{
    Columns, Digest, Occupancy, OctreeExport, coarse, columns, digest, merged, octree_blocks, point, region,
};
use crate::error::{Error, Result};
use crate::mapper::MapView;
use crate::octree::Octree;
use crate::sensor::Evidence;
use crate::space::{Aabb, Point};
use crate::tile::{Voxel, VoxelLayers};
use std::io::{self, Read, Seek, Write};

/// Additional queries of maps of tiles, beyond [`Queries`](super::Queries): exact evidence, coarse nodes, the whole
/// map.
///
/// A query fails only if a tile cannot be read, or if an evicted tile cannot be written.
pub trait MapQueries: MapView + Sized {
    /// Returns the observed voxel that contains a point, with its exact evidence.
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read or, for a mapper, an evicted one cannot be written.
    #[inline]
    fn voxel_at(&self, point: Point) -> Result<Option<Voxel>> {
        point::voxel_at(self, point)
    }

    /// Returns the exact evidence at many points, in their order, on all cores. Each tile is read once or a few times.
    ///
    /// # Errors
    ///
    /// Same errors as [`MapQueries::voxel_at`].
    fn evidence_at_points(&self, points: &[Point]) -> Result<Vec<Option<Evidence>>> {
        point::evidence_at_points(self, points)
    }

    /// Returns the occupancy of the octree node at `depth` that contains a point: the largest log-odds under the node
    /// as `f32`, OctoMap's precision. A node at depth 1 is half as wide as OctoMap's space, at depth 15 two voxels
    /// wide. At depth 16 the node is the voxel, and the result is bit-identical to
    /// [`Queries::occupancy_at`](super::Queries::occupancy_at).
    ///
    /// # Errors
    ///
    /// Fails if the depth is not from 1 to 16.
    fn occupancy_at_depth(&self, point: Point, depth: u8) -> Result<Occupancy> {
        coarse::occupancy_at_depth(self, point, depth)
    }

    /// Iterates over the observed voxels whose center is in the half-open box, with their exact evidence: tile by tile,
    /// in Morton order within each. A tile is read when its first voxel is requested.
    fn evidence_in(&self, region: &Aabb) -> impl Iterator<Item = Result<Voxel>> + '_ {
        region::evidence_in(self, region)
    }

    /// Visits the observed voxels whose center is in the half-open box, in the order of [`MapQueries::evidence_in`].
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read or, for a mapper, an evicted one cannot be written.
    fn for_each_voxel_in(&self, region: &Aabb, visit: impl FnMut(Voxel)) -> Result<()> {
        region::for_each_voxel_in(self, region, visit)
    }

    /// Visits the voxels of the whole map, or of a region, whose probability of being occupied is at least
    /// `min_probability`; `None` uses the occupancy threshold of the map.
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read.
    fn for_each_occupied(
        &self,
        min_probability: Option<f64>,
        region: Option<&Aabb>,
        visit: impl FnMut(Voxel),
    ) -> Result<()> {
        region::for_each_occupied(self, min_probability, region, visit)
    }

    /// Returns a 2D occupancy grid of the half-open box, for ground robots: the state of each column of voxels whose
    /// center is in the box. Only voxels that reach between two heights in metres determine the state. The grid is the
    /// smallest rectangle around the observed voxels of the box.
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read or the grid has more than 2^31 columns.
    fn columns_in(&self, region: &Aabb, heights_m: [f64; 2]) -> Result<Columns> {
        columns::columns_in(self, region, heights_m)
    }

    /// Returns the occupied voxels of the whole map. For large maps use [`MapQueries::for_each_occupied`].
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read.
    fn all_occupied_voxels(&self, min_probability: Option<f64>) -> Result<Vec<Voxel>> {
        let mut voxels = Vec::new();
        self.for_each_occupied(min_probability, None, |voxel| voxels.push(voxel))?;
        Ok(voxels)
    }

    /// Returns the occupied voxels of tiles in memory only; the result depends on the cache.
    ///
    /// # Errors
    ///
    /// Fails if another thread evicts a tile during the query and it cannot be read again.
    fn cached_occupied_voxels(&self, min_probability: Option<f64>) -> Result<Vec<Voxel>> {
        region::cached_occupied_voxels(self, min_probability)
    }

    /// Returns the digest of the map's content: equal for equal maps, however they were built. See `docs/format.md`.
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read.
    fn digest(&self) -> Result<Digest> {
        digest::digest(self)
    }

    /// Returns the digest of the map's layers: equal for equal layers, however they were built. See `docs/format.md`.
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read.
    fn layer_digest(&self) -> Result<Digest> {
        digest::layer_digest(self)
    }

    /// Returns what the map's layers store of the points that hit the voxel that contains a point; `None` if no point
    /// hit it, and in a map without layers.
    ///
    /// # Errors
    ///
    /// Same errors as [`MapQueries::voxel_at`].
    fn layers_at(&self, point: Point) -> Result<Option<VoxelLayers>> {
        let grid = &self.config().grid;
        let Some(voxel) = grid.voxel_of(point) else { return Ok(None) };
        Ok(self.tile(grid.tile_of_voxel(voxel))?.and_then(|tile| tile.layers_of(voxel)))
    }

    /// Returns one octree of the whole map or of a region, as in OctoMap, in memory. For larger maps use
    /// [`MapQueries::write_octree`].
    ///
    /// # Errors
    ///
    /// Fails if a voxel is outside OctoMap's key range of 65536 voxels per axis around the origin, or if there are more
    /// than `max_voxels` voxels.
    fn merged_octree(&self, region: Option<&Aabb>, max_voxels: u64) -> Result<Octree> {
        merged::merged_octree(self, region, max_voxels)
    }

    /// Writes the tree of [`MapQueries::merged_octree`] to a `.bt` or `.ot` file without building the tree, so that its
    /// size is not limited. Returns the number of voxels.
    ///
    /// The spool, an empty file or a [`Cursor`](std::io::Cursor), receives as many bytes as the file. `out` is written
    /// only after all tiles were read.
    ///
    /// # Errors
    ///
    /// Fails if a voxel is outside OctoMap's key range; returns errors from the spool or `out`.
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
