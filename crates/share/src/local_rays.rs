use rustc_hash::FxHashSet;
use voxtile::scan::{MAX_RAY_STEPS, RayWalk, Scan};
use voxtile::space::{Grid, Point, VoxelIndex};
use voxtile_local::{LocalMap, LocalParameters};

/// Rays that a local map has cast for a scan.
pub(super) struct LocalRays<'a> {
    map: &'a LocalMap,
    scan: &'a Scan,
    grid: &'a Grid,
    /// Squared minimum and maximum distance of points.
    ranges_m2: [f64; 2],
}

impl<'a> LocalRays<'a> {
    /// Returns the rays of the scan that the map inserted last. `grid` must have the map's resolution.
    pub(super) fn new(map: &'a LocalMap, scan: &'a Scan, grid: &'a Grid) -> Self {
        let LocalParameters { min_input_range_m, input_range_m, .. } = *map.parameters();
        let ranges_m2 = [min_input_range_m, input_range_m].map(|range_m| range_m * range_m);
        Self { map, scan, grid, ranges_m2 }
    }

    /// Returns the voxels of `wanted` that a ray passes. The others left the map because of the limit on voxels.
    pub(super) fn passed(&self, mut wanted: FxHashSet<VoxelIndex>) -> FxHashSet<VoxelIndex> {
        let mut found = FxHashSet::default();
        let Some(start) = self.grid.voxel_of(self.scan.origin) else { return found };
        let origin = self.grid.to_voxel_units(self.scan.origin);
        for &point in &self.scan.points {
            let Some(last) = self.end_voxel(point) else { continue };
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

    /// Returns the voxel of a point; `None` if the map skipped the point and its ray.
    fn end_voxel(&self, point: Point) -> Option<VoxelIndex> {
        let [x, y, z]: Point = std::array::from_fn(|k| point[k] - self.scan.origin[k]);
        let squared = x * x + y * y + z * z;
        let [nearest, farthest] = self.ranges_m2;
        let is_in_range = squared >= nearest && squared <= farthest;
        self.map.voxel_of(point).filter(|_| is_in_range)
    }
}
