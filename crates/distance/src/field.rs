use crate::cap::Cap;
use crate::clearance::{self, Clearance};
use crate::distance::{Distance, DistanceAndGradient};
use crate::extent::Extent;
use crate::interpolation::{Between, Scale};
use crate::line::{LANES, Line};
use crate::observed::Observed;
use crate::options::DistanceOptions;
use crate::solve::Solver;
use crate::tiles_of_map::read_box;
use crate::voxel_distance::VoxelDistance;
use rayon::prelude::*;
use voxtile::mapper::MapView;
use voxtile::query::occupied_set::OccupiedSet;
use voxtile::space::VoxelBox;
use voxtile::{Aabb, Grid, Occupancy, Point, Queries, Result, VoxelIndex};

/// Distances of the voxels of a box, in memory.
///
/// ```
/// use voxtile::{Aabb, InMemoryMapper, MapConfig, Mapper, Scan};
/// use voxtile_distance::{Distance, DistanceOptions, MapDistances, UnknownRule};
///
/// # fn main() -> voxtile::Result<()> {
/// let mut map = InMemoryMapper::new(MapConfig::new(0.1, 10.0)?)?;
/// map.insert_scan(&Scan { points: vec![[4.05, 0.05, 0.05]], ..Scan::default() })?;
/// let region = Aabb { min: [0.0, -2.0, -2.0], max: [6.0, 2.0, 2.0] };
/// let options = DistanceOptions::new(3.0).with_unknown(UnknownRule::Free);
/// let field = map.distance_field(&region, options)?;
/// let found = field.distance_and_gradient_at(&[[3.05, 0.05, 0.05]]);
/// assert!(matches!(found[0].distance, Distance::Within(distance_m) if (distance_m - 1.0).abs() < 1e-9));
/// assert!(found[0].gradient[0] < -0.99); // Away from the obstacle.
/// assert!(!field.clearance_along(&[[0.5, 0.5, 0.0], [5.5, 0.5, 0.0]], 0.6)?.is_clear());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct DistanceField {
    grid: Grid,
    options: DistanceOptions,
    extent: Extent,
    scale: Scale,
    /// Lines of each z.
    chunks: usize,
    /// Stored distances by y, z, x.
    lines: Vec<Line>,
}

/// Fields of maps of tiles.
pub trait MapDistances: MapView + Sized {
    /// Computes the distances of the voxels whose center is in a half-open box. Obstacles outside of the box count, up
    /// to the cap.
    ///
    /// Memory: about eight bytes per voxel of the box, more if the cap is as large as the box.
    ///
    /// # Errors
    ///
    /// Fails if the cap is invalid, the box has more than 2^31 voxels, or a tile cannot be read.
    fn distance_field(&self, region: &Aabb, options: DistanceOptions) -> Result<DistanceField> {
        DistanceField::of_map(self, region, options)
    }
}

impl<V: MapView> MapDistances for V {}

impl DistanceField {
    fn of_map(map: &impl MapView, region: &Aabb, options: DistanceOptions) -> Result<Self> {
        let grid = map.config().grid;
        Self::solve(grid, region, options, |around| read_box(map, around, &options))
    }

    /// As [`MapDistances::distance_field`], for anything with [`Queries`]. Maps of tiles are faster with that method.
    /// Local maps and layers of other robots do not know free voxels: use [`UnknownRule::Free`](crate::UnknownRule).
    ///
    /// # Errors
    ///
    /// As for [`MapDistances::distance_field`].
    pub fn of_queries(map: &dyn Queries, region: &Aabb, options: DistanceOptions) -> Result<Self> {
        let grid = map.grid();
        Self::solve(grid, region, options, |around| {
            let mut observed = Observed::new(around, &options);
            // Voxels are selected by their centers.
            let VoxelBox { min, end } = around.voxels();
            let region = Aabb {
                min: min.map(|k| f64::from(k) * grid.resolution_m()),
                max: end.map(|k| f64::from(k) * grid.resolution_m()),
            };
            for voxel in map.voxels_in(&region) {
                let voxel = voxel?;
                if let Occupancy::Occupied(_) = voxel.occupancy {
                    observed.occupied.toggle(voxel.voxel);
                }
                if let Some(known) = &mut observed.known {
                    known.toggle(voxel.voxel);
                }
            }
            Ok(observed)
        })
    }

    /// As [`MapDistances::distance_field`], for a set of occupied voxels such as the obstacles of a local map. All other
    /// voxels are unknown: use [`UnknownRule::Free`](crate::UnknownRule).
    ///
    /// # Errors
    ///
    /// As for [`MapDistances::distance_field`].
    pub fn of_set(set: &impl OccupiedSet, region: &Aabb, options: DistanceOptions) -> Result<Self> {
        Self::solve(set.grid_of_set(), region, options, |around| {
            let mut observed = Observed::new(around, &options);
            set.visit_in(&around.voxels(), &mut |voxel| {
                observed.occupied.toggle(voxel);
                if let Some(known) = &mut observed.known {
                    known.toggle(voxel);
                }
                true
            });
            Ok(observed)
        })
    }

    fn solve(
        grid: Grid,
        region: &Aabb,
        options: DistanceOptions,
        read: impl FnOnce(Extent) -> Result<Observed>,
    ) -> Result<Self> {
        let cap = Cap::of(options.max_distance_m, grid.resolution_m())?;
        let extent = Extent::of(&grid.voxels_in(region));
        extent.check_size()?;
        extent.grown(cap.reach).check_size()?;
        let observed = read(extent.grown(cap.reach))?;
        let mut solver = Solver::new(extent, cap, options);
        solver.compute(&observed);
        Ok(Self::of_lines(grid, options, extent, solver.into_distances(&observed)))
    }

    pub(crate) fn of_lines(grid: Grid, options: DistanceOptions, extent: Extent, lines: Vec<Line>) -> Self {
        let scale = Scale::new(grid.resolution_m(), options.max_distance_m);
        Self { grid, options, extent, scale, chunks: extent.size[0].div_ceil(LANES), lines }
    }

    /// Returns the voxels of the field whose center is in a half-open box; voxels outside of the field are unknown.
    ///
    /// # Errors
    ///
    /// Fails if the box has more than 2^31 voxels.
    pub fn part(&self, region: &Aabb) -> Result<Self> {
        let extent = Extent::of(&self.grid.voxels_in(region));
        extent.check_size()?;
        let mut part =
            Self { lines: Vec::new(), extent, chunks: extent.size[0].div_ceil(LANES), ..self.clone_empty() };
        part.lines =
            vec![[VoxelDistance::UNKNOWN.to_bits(); LANES]; part.chunks * extent.size[1] * extent.size[2]];
        let common = Extent::of(&extent.voxels().intersection(&self.extent.voxels()));
        let at = |outer: &Self, y: usize, z: usize| {
            let [from_x, from_y, from_z]: [usize; 3] =
                std::array::from_fn(|k| (common.min[k] - outer.extent.min[k]) as usize);
            ((from_y + y) * outer.extent.size[2] + from_z + z) * outer.chunks * LANES + from_x
        };
        for y in 0..common.size[1] {
            for z in 0..common.size[2] {
                let (from, to) = (at(self, y, z), at(&part, y, z));
                let row = &self.lines.as_flattened()[from..from + common.size[0]];
                part.lines.as_flattened_mut()[to..to + common.size[0]].copy_from_slice(row);
            }
        }
        Ok(part)
    }

    /// Returns the field without its distances.
    fn clone_empty(&self) -> Self {
        Self::of_lines(self.grid, self.options, self.extent, Vec::new())
    }

    pub(crate) fn into_lines(self) -> Vec<Line> {
        self.lines
    }

    /// Grid of the map.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Parameters of the field.
    pub fn options(&self) -> DistanceOptions {
        self.options
    }

    /// The voxels of the field.
    pub fn voxel_box(&self) -> VoxelBox {
        self.extent.voxels()
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.lines.capacity() * size_of::<Line>()
    }

    /// Exact distance of a voxel; unknown outside of the field.
    #[inline]
    pub fn voxel(&self, voxel: VoxelIndex) -> VoxelDistance {
        self.extent.place_of(voxel).map_or(VoxelDistance::UNKNOWN, |place| self.at(place))
    }

    #[inline]
    fn at(&self, [x, y, z]: [usize; 3]) -> VoxelDistance {
        VoxelDistance(self.lines.as_flattened()[(y * self.extent.size[2] + z) * self.chunks * LANES + x])
    }

    /// Distances of all voxels: by z, then y, then x.
    pub fn to_array(&self) -> Vec<VoxelDistance> {
        let [x_edge, y_edge, z_edge] = self.extent.size;
        let row = |y: usize, z: usize| &self.lines[(y * z_edge + z) * self.chunks..][..self.chunks];
        let rows = (0..z_edge).flat_map(|z| (0..y_edge).map(move |y| (y, z)));
        rows.flat_map(|(y, z)| row(y, z).as_flattened()[..x_edge].iter().map(|&number| VoxelDistance(number)))
            .collect()
    }

    /// Returns the distance at a point, interpolated between the centers of the eight nearest voxels (trilinear).
    ///
    /// Unknown if any of the eight is unknown or outside of the field, [`Distance::Beyond`] if all are beyond the cap;
    /// if only some are, these count as at the cap. So the result never exceeds the interpolation of the true distances.
    pub fn distance_at(&self, point_m: Point) -> Distance {
        self.gradient_at(point_m).distance
    }

    /// Returns the distances at many points and their gradients, in order, on all cores.
    pub fn distance_and_gradient_at(&self, points_m: &[Point]) -> Vec<DistanceAndGradient> {
        /// Points of a task of a core.
        const TOGETHER: usize = 1024;
        points_m.par_iter().with_min_len(TOGETHER).map(|&point_m| self.gradient_at(point_m)).collect()
    }

    #[inline]
    fn gradient_at(&self, point_m: Point) -> DistanceAndGradient {
        let unknown = DistanceAndGradient { distance: Distance::Unknown, gradient: [0.0; 3] };
        let Some(between) = Between::of(&self.grid, point_m) else { return unknown };
        let (Some(low), Some(_)) = (
            self.extent.place_of(between.lowest),
            self.extent.place_of(between.lowest.map(|k| k.saturating_add(1))),
        ) else {
            return unknown;
        };
        let distances = self.lines.as_flattened();
        let z_step = self.chunks * LANES;
        let y_step = self.extent.size[2] * z_step;
        let first = low[1] * y_step + low[2] * z_step + low[0];
        let corners = std::array::from_fn(|k| {
            VoxelDistance(distances[first + (k & 1) + (k >> 1 & 1) * y_step + (k >> 2) * z_step])
        });
        between.interpolate(corners, &self.scale)
    }

    /// Checks a path, given by its corners in metres: whether all of it is at least `radius_m` away from obstacles.
    /// Unknown distances block it. The path is checked at least every half voxel, up to the first place that is not
    /// clear.
    ///
    /// # Errors
    ///
    /// Fails if the path is not finite, has more than 10^8 places, or the radius is not from 0 to the cap.
    pub fn clearance_along(&self, path: &[Point], radius_m: f64) -> Result<Clearance> {
        let (resolution_m, max_distance_m) = (self.scale.resolution_m(), self.scale.max_distance_m());
        clearance::along(
            path,
            radius_m,
            resolution_m,
            max_distance_m,
            |point_m| Ok(self.distance_at(point_m)),
        )
    }
}
