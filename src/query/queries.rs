use super::{Hit, Occupancy, RayQuery, Shape, UnknownAs};
use crate::error::Result;
use crate::space::{Aabb, Grid, Point, VoxelIndex};
use rayon::prelude::*;

/// A voxel and its occupancy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelOccupancy {
    /// The voxel's index; [`Grid::center_m`] has its place.
    pub voxel: VoxelIndex,
    /// Occupied or free.
    pub occupancy: Occupancy,
}

/// The observed voxels of a region, one by one; take as many as wanted.
pub type Voxels<'a> = Box<dyn Iterator<Item = Result<VoxelOccupancy>> + 'a>;

/// What can be asked of everything that knows what is occupied: both mappers, a [`MapReader`](crate::MapReader) and its
/// snapshots, a [`LiveReader`](crate::LiveReader) beside a mapper, the view of a local map, the layers of other robots,
/// and several of these [`United`](super::United).
///
/// Points are in metres in the world frame. A planner takes `&dyn Queries` and works with any of them.
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
/// Besides those that a method names: a tile that cannot be read; for a mapper, one that has to go for it and cannot be
/// written; for a [`LiveView`](crate::LiveView), [`Error::Expired`](crate::Error::Expired).
pub trait Queries: Sync {
    /// The voxels of the map.
    fn grid(&self) -> Grid;

    /// The occupancy of a voxel.
    ///
    /// # Errors
    ///
    /// As for all queries.
    fn occupancy(&self, voxel: VoxelIndex) -> Result<Occupancy>;

    /// The observed voxels whose center is in the half-open box, tile by tile; a tile is read when its first voxel is
    /// taken. Of a local map and of layers, the occupied ones.
    fn voxels_in(&self, region: &Aabb) -> Voxels<'_>;

    /// The first occupied voxel on a ray (or the first unknown one, if that is an obstacle), exactly as single steps
    /// would find it; `None` if the ray ends first.
    ///
    /// # Errors
    ///
    /// An origin without a voxel, a zero direction, a wrong range.
    fn cast_ray(&self, ray: &RayQuery) -> Result<Option<Hit>>;

    /// The same between two points, both of their voxels included.
    ///
    /// # Errors
    ///
    /// An end without a voxel, a segment through more than a million voxels.
    fn cast_segment(&self, from: Point, to: Point, unknown: UnknownAs) -> Result<Option<Hit>>;

    /// An occupied voxel that a body touches (or an unknown one, if that is an obstacle); `None` if the body is free of
    /// collision.
    ///
    /// # Errors
    ///
    /// A body that is not finite, or so large that its voxels have no index or, if the unknown is an obstacle, too many
    /// to be searched.
    fn collision(&self, body: &Shape, unknown: UnknownAs) -> Result<Option<Hit>>;

    /// The occupied voxel whose center is nearest to a point and at most `max_distance_m` away; at equal distances the
    /// one with the lowest index.
    ///
    /// # Errors
    ///
    /// A point that is not finite, a wrong distance.
    fn nearest_occupied(&self, point: Point, max_distance_m: f64) -> Result<Option<Hit>>;

    /// The occupancy of the voxel that holds a point; unknown for a point that is not finite.
    ///
    /// # Errors
    ///
    /// As for all queries.
    #[inline]
    fn occupancy_at(&self, point: Point) -> Result<Occupancy> {
        self.grid().voxel_of(point).map_or(Ok(Occupancy::Unknown), |voxel| self.occupancy(voxel))
    }

    /// The occupancy at many points, in their order, on all cores.
    ///
    /// # Errors
    ///
    /// As for all queries; of several, that of the first point.
    fn occupancy_at_points(&self, points: &[Point]) -> Result<Vec<Occupancy>> {
        on_all_cores(points, |point| self.occupancy_at(*point))
    }

    /// [`Queries::cast_ray`] for many rays, in their order, on all cores.
    ///
    /// # Errors
    ///
    /// As for [`Queries::cast_ray`]; of several, that of the first ray.
    fn cast_rays(&self, rays: &[RayQuery]) -> Result<Vec<Option<Hit>>> {
        on_all_cores(rays, |ray| self.cast_ray(ray))
    }
}

/// Asks many questions; of several errors the one of the first question is returned.
pub(super) fn on_all_cores<Q: Sync, A: Send>(
    questions: &[Q],
    ask: impl Fn(&Q) -> Result<A> + Sync,
) -> Result<Vec<A>> {
    let answers: Vec<Result<A>> = questions.par_iter().map(&ask).collect();
    answers.into_iter().collect()
}
