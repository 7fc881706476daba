use super::collector::BATCH;
use crate::scan::coherence::cell_of;
use crate::scan::ray::{RangeRule, RayEnd, RayOrigin, SlabSpan, Slope};
use crate::space::{Grid, Point, VoxelIndex};

/// Batch of at most [`BATCH`] points that are hits, with what their rays need, in columns.
///
/// Each step is one loop over all rows without a branch, which becomes vector instructions. Rows after the last point
/// are unused.
#[derive(Debug)]
pub(crate) struct HitBatch {
    len: usize,
    /// World frame, by axis: in metres, after [`HitBatch::find_rays`] in units of voxels.
    points: [[f64; BATCH]; 3],
    /// By axis.
    voxels: [[i32; BATCH]; 3],
    rays: [HitRay; BATCH],
}

/// What decides whether a ray has to be walked.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HitRay {
    /// Cell of directions; see [`cell_of`].
    pub(super) cell: u32,
    /// The last slab, numbered from that of the origin.
    pub(super) last_slab: u32,
}

impl Default for HitBatch {
    fn default() -> Self {
        let voxels = [[0; BATCH]; 3];
        Self { len: 0, points: [[0.0; BATCH]; 3], voxels, rays: [HitRay::default(); BATCH] }
    }
}

impl HitBatch {
    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds a point in metres. Returns whether the batch is full.
    #[inline]
    pub(crate) fn push(&mut self, point: Point) -> bool {
        let row = self.len % BATCH;
        (0..3).for_each(|axis| self.points[axis][row] = point[axis]);
        self.len = row + 1;
        self.len == BATCH
    }

    /// Removes the points that are not certainly hits, and passes them to `visit`.
    pub(crate) fn remove_uncertain(&mut self, range: &RangeRule, mut visit: impl FnMut(Point)) {
        let mut are_hits = [0_u32; BATCH];
        for (row, is_hit) in are_hits.iter_mut().enumerate() {
            *is_hit = u32::from(range.is_certainly_hit(self.point(row)));
        }
        if are_hits[..self.len].iter().fold(1, |all, is_hit| all & is_hit) == 1 {
            return;
        }
        let before = std::mem::take(&mut self.len);
        for (row, is_hit) in are_hits.into_iter().enumerate().take(before) {
            let point = self.point(row);
            match is_hit {
                0 => visit(point),
                _ => _ = self.push(point),
            }
        }
    }

    /// Determines the rays to the points, whose voxels must all fit.
    pub(crate) fn find_rays(&mut self, grid: &Grid, origin: &RayOrigin) {
        for axis in 0..3 {
            for (point, voxel) in self.points[axis].iter_mut().zip(&mut self.voxels[axis]) {
                *point = grid.voxel_unit_of(*point);
                *voxel = Grid::floor_of_fitting(*point);
            }
        }
        for row in 0..BATCH {
            let (point, voxel) = (self.point(row), self.voxel(row));
            let slope = Slope::of(std::array::from_fn(|k| point[k] - origin.point[k]));
            let [x, y, z]: [u32; 3] = std::array::from_fn(|k| voxel[k].abs_diff(origin.voxel[k]));
            let last_slab = if slope.axis == 0 { x } else { z };
            let last_slab = if slope.axis == 1 { y } else { last_slab };
            self.rays[row] = HitRay { cell: cell_of(&slope), last_slab };
        }
    }

    pub(super) fn rays(&self) -> &[HitRay] {
        &self.rays[..self.len]
    }

    pub(super) fn end(&self, row: usize) -> RayEnd {
        RayEnd { point: self.point(row), voxel: self.voxel(row), hit: Some(0.0), span: SlabSpan::WHOLE }
    }

    #[inline(always)]
    pub(super) fn voxel(&self, row: usize) -> VoxelIndex {
        std::array::from_fn(|axis| self.voxels[axis][row % BATCH])
    }

    #[inline(always)]
    fn point(&self, row: usize) -> Point {
        std::array::from_fn(|axis| self.points[axis][row % BATCH])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::RayConfig;
    use crate::scan::ray::SlabRay;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rays_of_a_batch_equal_those_of_its_points(
            origin_m in prop::array::uniform3(-20.0..20.0_f64),
            points in prop::collection::vec(prop::array::uniform3(-40.0..40.0_f64), 0..=BATCH),
            around in prop::option::of((0..BATCH, prop::array::uniform3(-1..=1_i32))),
            has_invalid in any::<bool>(),
        ) {
            let mut points = points;
            let row = around.map(|(row, steps)| (row % points.len().max(1), steps));
            if let Some((row, steps)) = row && row < points.len() {
                // Along an axis or a diagonal, or the origin itself.
                points[row] = std::array::from_fn(|k| origin_m[k] + 3.0 * f64::from(steps[k]));
            }
            if let Some(point) = points.first_mut().filter(|_| has_invalid) {
                *point = [f64::NAN, 0.0, f64::INFINITY];
            }
            let rays = RayConfig { min_range_m: 0.5, max_range_m: Some(40.0), ..RayConfig::default() };
            let range = RangeRule::new(&rays, origin_m);
            let grid = Grid::new(0.25, 10.0).unwrap();
            let unit = grid.to_voxel_units(origin_m);
            let origin = RayOrigin::new(unit, grid.voxel_of(origin_m).unwrap());
            let mut batch = HitBatch::default();
            for (row, &point) in points.iter().enumerate() {
                prop_assert_eq!(batch.push(point), row + 1 == BATCH);
            }
            let mut others = Vec::new();
            batch.remove_uncertain(&range, |point| others.push(point));
            batch.find_rays(&grid, &origin);
            let (hits, rest): (Vec<Point>, Vec<Point>) =
                points.iter().partition(|point| range.is_certainly_hit(**point));
            prop_assert_eq!(format!("{others:?}"), format!("{rest:?}"));
            prop_assert_eq!(batch.rays().len(), hits.len());
            for (row, &point) in hits.iter().enumerate() {
                let end = batch.end(row);
                prop_assert_eq!(end.point, grid.to_voxel_units(point));
                prop_assert_eq!(Some(end.voxel), grid.voxel_of(point));
                let ray = SlabRay::new(&origin, end);
                let HitRay { cell, last_slab } = batch.rays()[row];
                prop_assert_eq!((cell, last_slab), (cell_of(&ray.slope()), ray.last_slab()));
            }
        }
    }
}
