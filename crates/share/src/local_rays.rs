use rustc_hash::FxHashSet;
use voxtile::scan::{MAX_RAY_STEPS, RayWalk, Scan};
use voxtile::space::{Grid, Point, VoxelIndex};
use voxtile_local::{LocalMap, LocalParameters};

/// The rays that a local map has cast for a scan.
pub(super) struct LocalRays<'a> {
    map: &'a LocalMap,
    scan: &'a Scan,
    grid: &'a Grid,
    /// Squared: the least and the most distance of points.
    ranges_m2: [f64; 2],
}

impl<'a> LocalRays<'a> {
    /// The rays of a scan that the map has just taken; `grid` has the map's resolution.
    pub(super) fn new(map: &'a LocalMap, scan: &'a Scan, grid: &'a Grid) -> Self {
        let LocalParameters { min_input_range_m, input_range_m, .. } = *map.parameters();
        let ranges_m2 = [min_input_range_m, input_range_m].map(|range_m| range_m * range_m);
        Self { map, scan, grid, ranges_m2 }
    }

    /// The voxels of a set that rays pass; no ray passes voxels that left by age.
    pub(super) fn passed(&self, mut wanted: FxHashSet<VoxelIndex>) -> FxHashSet<VoxelIndex> {
        let mut found = FxHashSet::default();
        let Some(start) = self.grid.voxel_of(self.scan.origin) else { return found };
        let origin = self.grid.to_voxel_units(self.scan.origin);
        for &point in &self.scan.points {
            let Some(last) = self.voxel_that_counts(point) else { continue };
            let walk = RayWalk::between(origin, start, self.grid.to_voxel_units(point), last);
            if walk.steps() > MAX_RAY_STEPS {
                continue;
            }
            walk.for_each_before_end(|voxel| {
                if wanted.remove(&voxel) {
                    found.insert(voxel);
                }
            });
            if wanted.is_empty() {
                break;
            }
        }
        found
    }

    /// The voxel of a point, by the map's own rule; `None` if the map has skipped the point, with its ray.
    fn voxel_that_counts(&self, point: Point) -> Option<VoxelIndex> {
        let [x, y, z]: Point = std::array::from_fn(|k| point[k] - self.scan.origin[k]);
        let squared = x * x + y * y + z * z;
        let [nearest, farthest] = self.ranges_m2;
        let is_in_range = squared >= nearest && squared <= farthest;
        self.map.voxel_of(point).filter(|_| is_in_range)
    }
}
