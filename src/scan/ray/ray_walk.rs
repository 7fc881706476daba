use crate::space::{Point, VoxelBox, VoxelIndex};

/// Maximum number of steps of a ray; longer rays are skipped.
pub const MAX_RAY_STEPS: u64 = 1_000_000;

/// Exact 6-connected walk of a ray through the voxels it meets (Amanatides and Woo, "A fast voxel traversal algorithm
/// for ray tracing", Eurographics 1987), in closed form.
///
/// In units of voxels, the time of the k-th crossing of an axis is `(boundary_k - origin) * inv_direction`. It is
/// computed from scratch each time and never accumulated; at equal times the lowest axis is first. `inv_direction` is
/// at most `f64::MAX`. Therefore a visit of a voxel depends only on this voxel and the ray, and every algorithm that
/// uses this formula visits the same voxels.
#[derive(Clone, Debug)]
pub struct RayWalk {
    origin: Point,
    inv_direction: Point,
    step: [i32; 3],
    voxel: VoxelIndex,
    /// Time of the next crossing along each axis; infinite if there is none.
    next: Point,
    last: VoxelIndex,
    /// Time at which the ray entered the current voxel.
    entry: f64,
}

/// Result of [`RayWalk::advance_in`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Advanced {
    /// The condition is false for the current voxel.
    Stopped,
    /// The current voxel is outside, or was entered too late; the condition was not evaluated for it.
    Left,
    /// The condition is true for the current voxel, which is the last one.
    AtEnd,
}

impl RayWalk {
    /// Creates the walk from `origin` to `end`, both in units of voxels and inside `start` and `last`, their voxels.
    ///
    /// Times range from 0 at the origin to 1 at the end.
    pub fn between(origin: Point, start: VoxelIndex, end: Point, last: VoxelIndex) -> Self {
        let direction = std::array::from_fn(|k| end[k] - origin[k]);
        Self::new(origin, start, direction, last)
    }

    /// Creates the walk from `origin`, in units of voxels and inside the voxel `start`, along `direction`, in voxels
    /// per unit of time, up to the limits of `i32`.
    pub fn along(origin: Point, start: VoxelIndex, direction: Point) -> Self {
        let last = std::array::from_fn(|k| match direction[k] {
            d if d > 0.0 => i32::MAX - 1,
            d if d < 0.0 => i32::MIN,
            _ => start[k],
        });
        Self::new(origin, start, direction, last)
    }

    fn new(origin: Point, start: VoxelIndex, direction: Point, last: VoxelIndex) -> Self {
        let mut walk = Self {
            origin,
            // Clamped to finite values, so that a border through the origin is crossed at time 0 even by a very slow
            // ray.
            inv_direction: direction.map(|d| (1.0 / d).clamp(-f64::MAX, f64::MAX)),
            step: std::array::from_fn(|k| (i64::from(last[k]) - i64::from(start[k])).signum() as i32),
            voxel: start,
            next: [f64::INFINITY; 3],
            last,
            entry: 0.0,
        };
        (0..3).for_each(|axis| walk.next[axis] = walk.crossing(axis, walk.voxel[axis]));
        walk
    }

    /// Returns the same walk, continued from a later voxel that it visits.
    pub(crate) fn resumed_at(mut self, voxel: VoxelIndex) -> Self {
        self.voxel = voxel;
        self.next = std::array::from_fn(|axis| self.crossing(axis, voxel[axis]));
        self
    }

    /// Number of steps from the current voxel to the last.
    pub fn steps(&self) -> u64 {
        (0..3).map(|k| u64::from(self.voxel[k].abs_diff(self.last[k]))).sum()
    }

    /// Number of steps between the current voxel and another one that the walk visits, before or after it.
    pub(crate) fn steps_to(&self, voxel: VoxelIndex) -> u64 {
        (0..3).map(|k| u64::from(self.voxel[k].abs_diff(voxel[k]))).sum()
    }

    /// The current voxel.
    pub fn voxel(&self) -> VoxelIndex {
        self.voxel
    }

    /// Time at which the ray entered the current voxel.
    pub fn entry_time(&self) -> f64 {
        self.entry
    }

    /// Advances to the next voxel; has no effect at the last one.
    #[inline]
    pub fn advance(&mut self) {
        let axis = self.next_axis();
        if self.next[axis] < f64::INFINITY {
            self.entry = self.next[axis];
            self.voxel[axis] += self.step[axis];
            self.next[axis] = self.crossing(axis, self.voxel[axis]);
        }
    }

    /// Visits each voxel from the current one up to, but excluding, the last.
    ///
    /// Takes the same steps as [`RayWalk::advance`], with all state in registers, because a scan takes millions of
    /// steps.
    #[inline]
    pub fn for_each_before_end(self, visit: impl FnMut(VoxelIndex)) {
        let steps = self.steps();
        self.for_each_of_next(steps, visit);
    }

    /// Visits `steps` voxels, starting at the current one; there must be as many before the last.
    #[inline]
    pub(crate) fn for_each_of_next(self, steps: u64, mut visit: impl FnMut(VoxelIndex)) {
        let [ox, oy, oz] = self.origin;
        let [ix, iy, iz] = self.inv_direction;
        let [lx, ly, lz] = self.last;
        let [sx, sy, sz] = self.step;
        let [bx, by, bz] = self.step.map(|step| f64::from(step > 0));
        let [mut x, mut y, mut z] = self.voxel;
        let [mut tx, mut ty, mut tz] = self.next;
        for _ in 0..steps.min(self.steps()) {
            visit([x, y, z]);
            if tx <= ty && tx <= tz {
                x += sx;
                tx = if x == lx { f64::INFINITY } else { (f64::from(x) + bx - ox) * ix };
            } else if ty <= tz {
                y += sy;
                ty = if y == ly { f64::INFINITY } else { (f64::from(y) + by - oy) * iy };
            } else {
                z += sz;
                tz = if z == lz { f64::INFINITY } else { (f64::from(z) + bz - oz) * iz };
            }
        }
    }

    /// Advances from the current voxel, which is inside `region`, while the condition is true, to the first voxel that
    /// is outside or entered after `until`.
    ///
    /// Takes the same steps as [`RayWalk::advance`], with all state in registers.
    #[inline]
    pub(crate) fn advance_in(
        &mut self,
        region: &VoxelBox,
        until: f64,
        mut passes: impl FnMut(VoxelIndex) -> bool,
    ) -> Advanced {
        let [ox, oy, oz] = self.origin;
        let [ix, iy, iz] = self.inv_direction;
        let [lx, ly, lz] = self.last;
        let [sx, sy, sz] = self.step;
        let [bx, by, bz] = self.step.map(|step| f64::from(step > 0));
        let [mut x, mut y, mut z] = self.voxel;
        let [mut tx, mut ty, mut tz] = self.next;
        let mut entry = self.entry;
        // For each axis, the first coordinate outside of the region in the walk's direction. Along an axis without
        // steps, a coordinate that the walk never reaches.
        let [ex, ey, ez]: VoxelIndex = std::array::from_fn(|k| match self.step[k] {
            1 => region.end[k],
            -1 => region.min[k].wrapping_sub(1),
            _ => i32::MIN,
        });
        let advanced = loop {
            if !passes([x, y, z]) {
                break Advanced::Stopped;
            }
            let is_outside;
            if tx <= ty && tx <= tz {
                if tx == f64::INFINITY {
                    break Advanced::AtEnd;
                }
                entry = tx;
                x += sx;
                tx = if x == lx { f64::INFINITY } else { (f64::from(x) + bx - ox) * ix };
                is_outside = x == ex;
            } else if ty <= tz {
                entry = ty;
                y += sy;
                ty = if y == ly { f64::INFINITY } else { (f64::from(y) + by - oy) * iy };
                is_outside = y == ey;
            } else {
                entry = tz;
                z += sz;
                tz = if z == lz { f64::INFINITY } else { (f64::from(z) + bz - oz) * iz };
                is_outside = z == ez;
            }
            if is_outside || entry > until {
                break Advanced::Left;
            }
        };
        (self.voxel, self.next, self.entry) = ([x, y, z], [tx, ty, tz], entry);
        advanced
    }

    /// Returns whether the current voxel is the last.
    pub fn is_at_end(&self) -> bool {
        self.voxel == self.last
    }

    /// Jumps to the first voxel outside `region`, which contains the current voxel, with the same result as single
    /// steps. Stops at the last voxel if that is reached first.
    pub fn leave(&mut self, region: &VoxelBox) {
        // The last voxel inside the region along each axis; its crossing leaves the region.
        let border: VoxelIndex = std::array::from_fn(|k| match self.step[k] {
            1 => (region.end[k] - 1).min(self.last[k]),
            -1 => region.min[k].max(self.last[k]),
            _ => self.voxel[k],
        });
        let exits: Point = std::array::from_fn(|k| self.crossing(k, border[k]));
        let exit_axis = earliest(exits);
        let exit = exits[exit_axis];
        if exit == f64::INFINITY {
            self.advance_to_end(border);
            return;
        }
        self.voxel = std::array::from_fn(|axis| match axis == exit_axis {
            true => border[axis] + self.step[axis],
            false => self.voxel_before(axis, border[axis], exit, axis < exit_axis),
        });
        self.next = std::array::from_fn(|axis| self.crossing(axis, self.voxel[axis]));
        self.entry = exit;
    }

    /// Jumps to the last voxel within `border` that single steps reach; crossings at infinite time never happen.
    fn advance_to_end(&mut self, border: VoxelIndex) {
        let end: VoxelIndex =
            std::array::from_fn(|axis| self.voxel_before(axis, border[axis], f64::INFINITY, false));
        for (axis, &last) in end.iter().enumerate() {
            if last != self.voxel[axis] {
                // Times are ascending: the latest of the axes' last crossings is the last of all.
                self.entry = self.entry.max(self.crossing(axis, last - self.step[axis]));
            }
        }
        self.voxel = end;
        self.next = std::array::from_fn(|axis| self.crossing(axis, self.voxel[axis]));
    }

    /// Jumps to the first voxel inside `region`, with the same result as single steps; has no effect if the current one
    /// is inside. Returns `false`, without moving, if the rest of the ray never meets the region.
    pub fn enter(&mut self, region: &VoxelBox) -> bool {
        if region.is_empty() {
            return false;
        }
        // For each axis that is not inside yet, the crossing that enters the region's range. The last of these enters
        // the region; at equal times the highest axis is last.
        let mut entry: Option<(f64, usize)> = None;
        for axis in 0..3 {
            let (voxel, first, last) = (self.voxel[axis], region.min[axis], region.end[axis] - 1);
            let before = match self.step[axis] {
                _ if (first..=last).contains(&voxel) => continue,
                1 if voxel < first && first <= self.last[axis] => first - 1,
                -1 if voxel > last && last >= self.last[axis] => last + 1,
                _ => return false,
            };
            let time = self.crossing(axis, before);
            if entry.is_none_or(|(latest, _)| time >= latest) {
                entry = Some((time, axis));
            }
        }
        let Some((time, entry_axis)) = entry else { return true };
        // Crossings at infinite time never happen.
        if time == f64::INFINITY {
            return false;
        }
        let voxel = std::array::from_fn(|axis| match axis == entry_axis {
            true if self.step[axis] > 0 => region.min[axis],
            true => region.end[axis] - 1,
            false => self.voxel_before(axis, self.last[axis], time, axis < entry_axis),
        });
        // When the ray enters the range along the last axis, it may already have left the range along another one.
        if !region.contains(voxel) {
            return false;
        }
        self.voxel = voxel;
        self.next = std::array::from_fn(|axis| self.crossing(axis, self.voxel[axis]));
        self.entry = time;
        true
    }

    /// Returns the voxel along `axis`, between the current one and `border`, at time `exit`: crossings before `exit`
    /// have happened, and those at `exit` if `ties_first`. Times ascend along the ray, so bisection finds the voxel.
    fn voxel_before(&self, axis: usize, border: i32, exit: f64, ties_first: bool) -> i32 {
        let done = |voxel: i32| {
            let time = self.crossing(axis, voxel);
            time < exit || (ties_first && time == exit)
        };
        let after = |steps: i64| (i64::from(self.voxel[axis]) + steps * i64::from(self.step[axis])) as i32;
        let (mut low, mut high) = (0, i64::from(border.abs_diff(self.voxel[axis])));
        while low < high {
            let middle = (low + high) / 2;
            if done(after(middle)) {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        after(low)
    }

    /// Time at which the ray leaves `voxel` along `axis`; infinite from the last voxel on.
    #[inline]
    fn crossing(&self, axis: usize, voxel: i32) -> f64 {
        if voxel == self.last[axis] {
            return f64::INFINITY;
        }
        let boundary = f64::from(voxel) + f64::from(self.step[axis] > 0);
        (boundary - self.origin[axis]) * self.inv_direction[axis]
    }

    #[inline]
    fn next_axis(&self) -> usize {
        earliest(self.next)
    }
}

/// Returns the axis with the smallest time, the lowest at equal times.
#[inline]
fn earliest(times: Point) -> usize {
    let [x, y, z] = times;
    if x <= y {
        if x <= z { 0 } else { 2 }
    } else if y <= z {
        1
    } else {
        2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn walk(from: Point, to: Point) -> RayWalk {
        RayWalk::between(from, from.map(|x| x.floor() as i32), to, to.map(|x| x.floor() as i32))
    }

    fn voxels(mut walk: RayWalk) -> Vec<VoxelIndex> {
        let first = walk.clone();
        let mut visited = vec![walk.voxel()];
        while !walk.is_at_end() {
            walk.advance();
            visited.push(walk.voxel());
        }
        let mut all_at_once = Vec::new();
        first.for_each_before_end(|voxel| all_at_once.push(voxel));
        assert_eq!(all_at_once, visited[..visited.len() - 1]);
        visited
    }

    #[test]
    fn ties_cross_the_lowest_axis_first() {
        assert_eq!(
            voxels(walk([0.5; 3], [2.5; 3])),
            [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1], [2, 1, 1], [2, 2, 1], [2, 2, 2]]
        );
    }

    #[test]
    fn a_ray_inside_one_voxel_has_no_steps() {
        assert_eq!(voxels(walk([0.1, 0.2, 0.3], [0.9, 0.2, 0.4])), [[0, 0, 0]]);
    }

    #[test]
    fn a_border_through_the_origin_is_crossed_at_time_0() {
        let least = f64::from_bits(1);
        for slow in [-1e-310, -least, -f64::MIN_POSITIVE, -1e-300] {
            let visited = voxels(walk([0.5, 0.0, 0.5], [2.5, slow, 0.5]));
            assert_eq!(visited, [[0, 0, 0], [0, -1, 0], [1, -1, 0], [2, -1, 0]], "{slow}");
            let region = VoxelBox { min: [-4; 3], end: [4; 3] };
            let mut endless = RayWalk::along([0.5, 0.0, 0.5], [0; 3], [1.0, slow, 0.0]);
            let advanced = endless.clone().advance_in(&region, f64::INFINITY, |_| true);
            assert_eq!(advanced, Advanced::Left, "{slow}");
            endless.leave(&region);
            assert_eq!(endless.voxel(), [4, -1, 0], "{slow}");
        }
    }

    #[test]
    fn a_box_at_the_index_limit_is_left_correctly() {
        let region = VoxelBox { min: [i32::MAX - 50, -50, -50], end: [i32::MAX, 50, 50] };
        for slow in [0.0, 1e-310, -1e-310, 1e-307, -3e-308, f64::from_bits(1)] {
            let start = [i32::MAX - 40, 0, 0];
            let origin = [f64::from(start[0]) + 0.5, 0.0, 0.5];
            let mut stepped = RayWalk::along(origin, start, [1.0, slow, 0.0]);
            for _ in 0..200 {
                stepped.advance();
            }
            let mut jumped = RayWalk::along(origin, start, [1.0, slow, 0.0]);
            jumped.leave(&region);
            assert_eq!(jumped.voxel(), stepped.voxel(), "{slow}");
            assert_eq!(jumped.entry_time().to_bits(), stepped.entry_time().to_bits(), "{slow}");
        }
    }

    proptest! {
        #[test]
        fn each_step_approaches_the_end_through_voxels_on_the_ray(
            from in prop::array::uniform3(-40.0..40.0_f64),
            to in prop::array::uniform3(-40.0..40.0_f64),
        ) {
            let ray = walk(from, to);
            let steps = ray.steps() as usize;
            let visited = voxels(ray);
            prop_assert_eq!(visited.len(), steps + 1);
            for voxel in &visited {
                // Slab test with a margin for rounding.
                let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
                for k in 0..3 {
                    let d = to[k] - from[k];
                    let near = (f64::from(voxel[k]) - from[k]) / d;
                    let far = (f64::from(voxel[k]) + 1.0 - from[k]) / d;
                    enter = enter.max(near.min(far));
                    leave = leave.min(near.max(far));
                }
                prop_assert!(enter <= leave + 1e-9, "{:?} is not on the ray", voxel);
            }
        }

        #[test]
        fn entering_a_box_equals_single_steps(
            from in prop::array::uniform3(-60.0..60.0_f64),
            to in prop::array::uniform3(-60.0..60.0_f64),
            snap in prop::bool::ANY,
        ) {
            // With snapping, many crossings are ties, and some rays are parallel to an axis.
            let grid = |p: Point| if snap { p.map(|x| (x / 8.0).round() * 8.0 + 0.5) } else { p };
            let (from, to) = (grid(from), grid(to));
            let region = VoxelBox { min: [-9, -20, 0], end: [17, 19, 30] };
            let mut jumped = walk(from, to);
            let entered = jumped.enter(&region);
            let mut stepped = walk(from, to);
            while !region.contains(stepped.voxel()) && !stepped.is_at_end() {
                stepped.advance();
            }
            prop_assert_eq!(entered, region.contains(stepped.voxel()));
            if entered {
                prop_assert_eq!(jumped.voxel(), stepped.voxel());
                prop_assert_eq!(jumped.entry_time().to_bits(), stepped.entry_time().to_bits());
                prop_assert_eq!(voxels(jumped), voxels(stepped));
            }
        }

        #[test]
        fn leaving_a_box_equals_single_steps(
            from in prop::array::uniform3(0.0..16.0_f64),
            to in prop::array::uniform3(-40.0..40.0_f64),
            snap in prop::bool::ANY,
        ) {
            // Snapped to quarters, many crossings are ties.
            let grid = |p: Point| if snap { p.map(|x| (x * 4.0).round() / 4.0 + 0.125 * f64::from(x > 8.0)) } else { p };
            let (from, to) = (grid(from), grid(to));
            let region = VoxelBox { min: [0, -3, -1], end: [17, 19, 20] };
            let mut jumped = walk(from, to);
            jumped.leave(&region);
            let mut stepped = walk(from, to);
            while region.contains(stepped.voxel()) && !stepped.is_at_end() {
                stepped.advance();
            }
            prop_assert_eq!(jumped.voxel(), stepped.voxel());
            prop_assert_eq!(jumped.entry_time().to_bits(), stepped.entry_time().to_bits());
            prop_assert_eq!(voxels(jumped), voxels(stepped));
        }
    }
}
