use super::place::{cell_at, ones, place_of};
use super::view::{LocalView, Obstacle};
use crate::error::{Error, Result};
use crate::query::{Nearest, Shape};
use crate::scan::{MAX_RAY_STEPS, RayWalk};
use crate::space::{Aabb, Point, VoxelBox, VoxelIndex};

/// Queries of planners.
impl LocalView {
    /// The first obstacle on a segment between two points in metres, including both ends.
    ///
    /// # Errors
    ///
    /// An end without a voxel, or a segment through more than a million voxels.
    pub fn first_on_segment(&self, from: Point, to: Point, obstacle: Obstacle) -> Result<Option<VoxelIndex>> {
        let (Some(start), Some(last)) = (self.grid.voxel_of(from), self.grid.voxel_of(to)) else {
            let reason = format!("{from:?} to {to:?} m is not finite or too far away for voxel indices");
            return Err(Error::argument("segment", reason));
        };
        let (from, to) = (self.grid.to_voxel_units(from), self.grid.to_voxel_units(to));
        let mut walk = RayWalk::between(from, start, to, last);
        if walk.steps() > MAX_RAY_STEPS {
            let reason = format!("meets {} voxels; ask for at most {MAX_RAY_STEPS}", walk.steps());
            return Err(Error::argument("segment", reason));
        }
        loop {
            let voxel = walk.voxel();
            match self.empty_around(voxel) {
                None if obstacle.is(self.state(voxel)) => return Ok(Some(voxel)),
                _ if walk.is_at_end() => return Ok(None),
                None => walk.advance(),
                Some(empty) => walk.leave(&empty),
            }
        }
    }

    /// The largest empty cell around a voxel.
    fn empty_around(&self, voxel: VoxelIndex) -> Option<VoxelBox> {
        let cell = |shift: u32| {
            let min = voxel.map(|k| k >> shift << shift);
            Some(VoxelBox { min, end: min.map(|k| k.saturating_add(1 << shift)) })
        };
        let place = |shift: u32| place_of(voxel.map(|k| k >> shift));
        let Some(page) = self.pages.get(&voxel.map(|k| k >> 6)) else { return cell(6) };
        let Some(node) = page.node(place(4)) else { return cell(4) };
        if node.block(place(2)).is_none() { cell(2) } else { None }
    }

    /// An obstacle that a body touches; `None` if the body is free of collision.
    ///
    /// # Errors
    ///
    /// A body that is not finite, or with a negative radius.
    pub fn collision(&self, body: &Shape, obstacle: Obstacle) -> Result<Option<VoxelIndex>> {
        let around = self.voxels_around(&body.bounds()?);
        let mut found = None;
        self.for_each_obstacle_in(&around, obstacle, |voxel| {
            if found.is_none() && body.touches_voxel(&self.grid, voxel) {
                found = Some(voxel);
            }
            found.is_none()
        });
        Ok(found)
    }

    /// The obstacle whose center is nearest to a point and at most `radius_m` away; at equal distances the one with the
    /// lowest index.
    ///
    /// # Errors
    ///
    /// A point that is not finite, an invalid radius.
    pub fn nearest(&self, point: Point, radius_m: f64, obstacle: Obstacle) -> Result<Option<Nearest>> {
        if !(radius_m >= 0.0 && point.iter().all(|x| x.is_finite())) {
            let reason = "needs a finite point and a distance of at least 0 m";
            return Err(Error::argument("nearest obstacle", reason));
        }
        let mut best: Option<Nearest> = None;
        // Small balls first: the first that holds an obstacle holds the nearest.
        let mut reach_m = self.resolution_m() * 4.0;
        loop {
            let ball_m = reach_m.min(radius_m);
            let bounds = Aabb { min: point.map(|x| x - ball_m), max: point.map(|x| x + ball_m) };
            self.for_each_obstacle_in(&self.voxels_around(&bounds), obstacle, |voxel| {
                let center_m = self.grid.center_m(voxel);
                let distance_m = (0..3).map(|k| (center_m[k] - point[k]).powi(2)).sum::<f64>().sqrt();
                let is_nearer = best.is_none_or(|best| (distance_m, voxel) < (best.distance_m, best.voxel));
                if distance_m <= ball_m && is_nearer {
                    best = Some(Nearest { voxel, center_m, distance_m });
                }
                true
            });
            if best.is_some() || reach_m >= radius_m {
                return Ok(best);
            }
            reach_m *= 2.0;
        }
    }

    /// The centers, in metres, of the obstacles whose center is in the half-open box, in no particular order.
    pub fn points_in(&self, window: &Aabb, obstacle: Obstacle) -> Vec<Point> {
        let mut points = Vec::new();
        self.for_each_obstacle_in(&self.voxels_around(window), obstacle, |voxel| {
            let center_m = self.grid.center_m(voxel);
            if window.contains(center_m) {
                points.push(center_m);
            }
            true
        });
        points
    }

    /// The voxels whose center may be in a box, or that may touch it, and a few around; far corners saturate.
    fn voxels_around(&self, bounds: &Aabb) -> VoxelBox {
        let index = |x: f64| x.floor().clamp(-2e9, 2e9) as i32;
        VoxelBox {
            min: self.grid.to_voxel_units(bounds.min).map(|x| index(x) - 1),
            end: self.grid.to_voxel_units(bounds.max).map(|x| index(x) + 2),
        }
    }

    /// Visits the obstacles of a box until `visit` returns false.
    fn for_each_obstacle_in(
        &self,
        voxels: &VoxelBox,
        obstacle: Obstacle,
        mut visit: impl FnMut(VoxelIndex) -> bool,
    ) {
        if voxels.is_empty() {
            return;
        }
        let touches = |index: VoxelIndex, shift: u32| {
            (0..3).all(|k| {
                let (min, end) = (i64::from(index[k]) << shift, (i64::from(index[k]) + 1) << shift);
                i64::from(voxels.min[k]) < end && min < i64::from(voxels.end[k])
            })
        };
        let mut search_page = |index: VoxelIndex| {
            let Some(page) = self.pages.get(&index) else { return true };
            for place in ones(page.mask) {
                let node_index = cell_at(index, place);
                let Some(node) = page.node(place).filter(|_| touches(node_index, 4)) else { continue };
                for place in ones(node.mask) {
                    let block_index = cell_at(node_index, place);
                    let Some(block) = node.block(place).filter(|_| touches(block_index, 2)) else { continue };
                    let mut inside = ones(block.obstacles(obstacle)).map(|place| cell_at(block_index, place));
                    if !inside.all(|voxel| !voxels.contains(voxel) || visit(voxel)) {
                        return false;
                    }
                }
            }
            true
        };
        let (first, last) = (voxels.min.map(|k| k >> 6), voxels.end.map(|k| (k - 1) >> 6));
        let pages = (0..3).map(|k| last[k].abs_diff(first[k]) as usize + 1).fold(1, usize::saturating_mul);
        if pages > self.pages.len() {
            self.pages.keys().filter(|index| touches(**index, 6)).all(|index| search_page(*index));
            return;
        }
        for x in first[0]..=last[0] {
            for y in first[1]..=last[1] {
                if !(first[2]..=last[2]).all(|z| search_page([x, y, z])) {
                    return;
                }
            }
        }
    }
}
