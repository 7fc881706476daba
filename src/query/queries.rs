use super::{Hit, Occupancy, RayQuery, Shape, UnknownAs};
use crate::error::Result;
use crate::space::{Aabb, Grid, Point, VoxelIndex};
use rayon::prelude::*;

/// Voxel with its occupancy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelOccupancy {
    /// Index of the voxel; [`Grid::center_m`] returns its center.
    pub voxel: VoxelIndex,
    /// Occupied or free.
    pub occupancy: Occupancy,
}

/// Lazy iterator over the observed voxels of a region.
pub type Voxels<'a> = Box<dyn Iterator<Item = Result<VoxelOccupancy>> + 'a>;

/// Queries that all occupancy representations support: both mappers, a [`MapReader`](crate::MapReader) and its
/// snapshots, a [`LiveReader`](crate::LiveReader) of a mapper, the view of a local map, the layers of other robots, and
/// several of these [`United`](super::United).
///
/// Points are in metres in the world frame. A planner that uses `&dyn Queries` works with any of them.
///
/// ```
/// use voxtile::{InMemoryMapper, MapConfig, Mapper, Queries, Scan, UnknownAs};
///
/// fn is_way_free(map: &dyn Queries, from: [f64; 3], to: [f64; 3]) -> voxtile::Result<bool> {
///     Ok(map.cast_segment(from, to, UnknownAs::Free)?.is_none())
/// }
///
/// # fn main() -> voxtile::Result<()> {
/// let mut map = InMemoryMapper::new(MapConfig::new(0.1, 10.0)?)?;
/// map.insert_scan(&Scan { origin: [0.0; 3], points: vec![[4.0, 0.0, 0.0]], intensities: None })?;
/// assert!(is_way_free(&map, [0.0; 3], [3.5, 0.0, 0.0])?);
/// assert!(!is_way_free(&map, [0.0; 3], [5.0, 0.0, 0.0])?);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
///
/// In addition to the errors of each method, a query fails if a tile cannot be read; for a mapper, also if an evicted
/// tile cannot be written; for a [`LiveView`](crate::LiveView), also with [`Error::Expired`](crate::Error::Expired).
pub trait Queries: Sync {
    /// Grid of the map.
    fn grid(&self) -> Grid;

    /// Returns the occupancy of a voxel.
    ///
    /// # Errors
    ///
    /// See [`Queries`].
    fn occupancy(&self, voxel: VoxelIndex) -> Result<Occupancy>;

    /// Iterates over the observed voxels whose center is in the half-open box, tile by tile; a tile is read when its
    /// first voxel is requested. Local maps and layers return only occupied voxels.
    fn voxels_in(&self, region: &Aabb) -> Voxels<'_>;

    /// Returns the first occupied voxel on a ray (or the first unknown one, if unknown space is an obstacle); `None` if
    /// the ray ends first. The result is the same as if every voxel on the ray were examined.
    ///
    /// # Errors
    ///
    /// Fails if the origin is outside of the map's space, the direction is zero or the range is invalid.
    fn cast_ray(&self, ray: &RayQuery) -> Result<Option<Hit>>;

    /// Like [`Queries::cast_ray`], between two points, including the voxels of both.
    ///
    /// # Errors
    ///
    /// Fails if an end is outside of the map's space, or the segment crosses more than a million voxels.
    fn cast_segment(&self, from: Point, to: Point, unknown: UnknownAs) -> Result<Option<Hit>>;

    /// Returns an occupied voxel that a body touches (or an unknown one, if unknown space is an obstacle); `None` if
    /// there is no collision.
    ///
    /// # Errors
    ///
    /// Fails if the body is not finite or exceeds the voxel index range or, if unknown space is an obstacle, covers too
    /// many voxels.
    fn collision(&self, body: &Shape, unknown: UnknownAs) -> Result<Option<Hit>>;

    /// Returns the occupied voxel whose center is closest to a point and at most `max_distance_m` away; of equally
    /// close ones, the one with the lowest index.
    ///
    /// # Errors
    ///
    /// Fails if the point is not finite or the distance is invalid.
    fn nearest_occupied(&self, point: Point, max_distance_m: f64) -> Result<Option<Hit>>;

    /// Returns the occupancy of the voxel that contains a point; unknown for a point that is not finite.
    ///
    /// # Errors
    ///
    /// See [`Queries`].
    #[inline]
    fn occupancy_at(&self, point: Point) -> Result<Occupancy> {
        self.grid().voxel_of(point).map_or(Ok(Occupancy::Unknown), |voxel| self.occupancy(voxel))
    }

    /// Returns the occupancy at many points, in their order, on all cores.
    ///
    /// # Errors
    ///
    /// See [`Queries`]; of several errors, that of the first point is returned.
    fn occupancy_at_points(&self, points: &[Point]) -> Result<Vec<Occupancy>> {
        on_all_cores(points, |point| self.occupancy_at(*point))
    }

    /// [`Queries::cast_ray`] for many rays, in their order, on all cores.
    ///
    /// # Errors
    ///
    /// Same errors as [`Queries::cast_ray`]; of several errors, that of the first ray is returned.
    fn cast_rays(&self, rays: &[RayQuery]) -> Result<Vec<Option<Hit>>> {
        on_all_cores(rays, |ray| self.cast_ray(ray))
    }
}

/// Runs many queries in parallel; of several errors, that of the first query is returned.
pub(super) fn on_all_cores<Q: Sync, A: Send>(
    questions: &[Q],
    ask: impl Fn(&Q) -> Result<A> + Sync,
) -> Result<Vec<A>> {
    let answers: Vec<Result<A>> = questions.par_iter().map(&ask).collect();
    answers.into_iter().collect()
}
