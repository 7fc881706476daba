use super::marks::Marks;
use super::ray::RayWalk;
use super::slab_masks::slab_bit;
use super::window::Local;
use crate::space::{Point, VoxelIndex};

/// A crossing nearer than this to a border between voxels, in units of 2^-32 voxels, is left to the exact walk.
///
/// That is 2^-20 voxels. A position is off by less than 2^-33 voxels a slab, of which a window has 2048 to either
/// side, and the closed form's times, rounded to `f64`, by less than 2^-38 voxels.
const NEAR_BORDER: u32 = 1 << 12;

/// Two crossings in one slab that are nearer to each other than this, in units of 2^-64 voxels, are left to the exact
/// walk: each side of the comparison is the product of a position, off by less than 2^12 units of 2^-32 voxels, and a
/// slope below 1, off by one unit.
const NEAR_EDGE: u64 = 1 << 46;

/// A ray from a scan's origin, in the terms of [`RayWalk`]: units of voxels, world frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlabRay {
    pub(super) origin: Point,
    pub(super) start: VoxelIndex,
    pub(super) end: Point,
    pub(super) last: VoxelIndex,
}

impl SlabRay {
    /// The exact walk of the ray, one voxel after the other.
    pub(super) fn walk(&self) -> RayWalk {
        RayWalk::between(self.origin, self.start, self.end, self.last)
    }

    /// Marks the voxels that [`RayWalk`] visits from the first up to, not including, the last; false if a crossing is
    /// too near to a border to tell without the closed form. What was marked until then is right.
    ///
    /// The walk goes in slabs, one voxel thick, along the axis of the ray's longest part. Where the ray crosses from
    /// slab to slab is a sum of fixed-point numbers, and the voxels it meets in a slab are the one it comes in by, the
    /// one it goes out by and, if these differ along both other axes, the one between them. That this is what the
    /// closed form says is certain as long as no crossing is next to a border.
    pub(super) fn mark(&self, marks: &mut Marks) -> bool {
        let length: Point = std::array::from_fn(|k| (self.end[k] - self.origin[k]).abs());
        if length[0] >= length[1] && length[0] >= length[2] {
            self.mark_along::<0, 1, 2>(marks)
        } else if length[1] >= length[2] {
            self.mark_along::<1, 0, 2>(marks)
        } else {
            self.mark_along::<2, 0, 1>(marks)
        }
    }

    /// `A` is the axis of the longest part, `B` and `C` are the others, the lower first.
    fn mark_along<const A: usize, const B: usize, const C: usize>(&self, marks: &mut Marks) -> bool {
        let Some(last) = marks.window().local(self.last) else { return false };
        let Some(start) = self.leave_borders(marks) else { return false };
        let [mut a, mut b, mut c] = [start[A], start[B], start[C]];
        let mut slabs = last[A].abs_diff(a);
        if slabs > 0 {
            let is_up = last[A] > a;
            let (step, first_of_brick) = if is_up { (1, 0) } else { (u32::MAX, 7) };
            let mut path = Path::along::<A, B, C>(self, marks.window().base(), a, is_up);
            let mut bit = slab_bit(b, c);
            // Once around for every brick that the ray comes into.
            let mut came_in_by = 0;
            while slabs > 0 {
                let slot = marks.slot_of(voxel::<A, B, C>(a, b, c));
                let in_brick = marks.slabs(slot, A);
                in_brick[(a.wrapping_sub(step) & 7) as usize] |= came_in_by;
                came_in_by = 0;
                loop {
                    if is_near_border(path.at_b) || is_near_border(path.at_c) {
                        return false;
                    }
                    let (exit_b, exit_c) = ((path.at_b >> 32) as u32, (path.at_c >> 32) as u32);
                    let (change_b, change_c) = (b ^ exit_b, c ^ exit_c);
                    // One branch that is seldom taken, where two would often be guessed wrong.
                    let is_diagonal = change_b * change_c != 0;
                    let exit_bit = slab_bit(exit_b, exit_c);
                    let (slab, entry_bit) = (a, std::mem::replace(&mut bit, exit_bit));
                    (a, slabs) = (a.wrapping_add(step), slabs - 1);
                    let is_at_end = slabs == 0 || a & 7 == first_of_brick;
                    if (change_b | change_c) < 8 {
                        in_brick[(slab & 7) as usize] |= entry_bit | exit_bit;
                        if is_diagonal {
                            let Some(is_b_first) = path.is_b_crossed_first() else { return false };
                            let (b, c) = if is_b_first { (exit_b, c) } else { (b, exit_c) };
                            in_brick[(slab & 7) as usize] |= slab_bit(b, c);
                        }
                        (b, c) = (exit_b, exit_c);
                        path.advance();
                        if is_at_end {
                            break;
                        }
                    } else {
                        in_brick[(slab & 7) as usize] |= entry_bit;
                        if is_diagonal {
                            let Some(is_b_first) = path.is_b_crossed_first() else { return false };
                            let (b, c) = if is_b_first { (exit_b, c) } else { (b, exit_c) };
                            mark_voxel::<A, B, C>(marks, slab, b, c);
                        }
                        (b, c) = (exit_b, exit_c);
                        path.advance();
                        if is_at_end {
                            mark_voxel::<A, B, C>(marks, slab, b, c);
                        } else {
                            came_in_by = exit_bit;
                        }
                        break;
                    }
                }
            }
        }
        self.mark_last_slab::<A, B, C>(marks, [b, c], start, last)
    }

    /// The crossings at time 0: an origin on a border between voxels belongs to the upper one, and a ray downward
    /// leaves it at once, the lowest axis first. Returns the voxel after them; `None` outside the window.
    #[inline]
    fn leave_borders(&self, marks: &mut Marks) -> Option<Local> {
        let mut voxel = marks.window().local(self.start)?;
        for axis in 0..3 {
            if self.last[axis] < self.start[axis] && f64::from(self.start[axis]) == self.origin[axis] {
                // The closed form has no number for a crossing of such a ray.
                if self.end[axis] - self.origin[axis] > -f64::MIN_POSITIVE {
                    return None;
                }
                marks.pass(voxel);
                voxel[axis] -= 1;
            }
        }
        Some(voxel)
    }

    /// The slab of the last voxel, from where the ray enters it: at most two voxels before the last.
    #[inline]
    fn mark_last_slab<const A: usize, const B: usize, const C: usize>(
        &self,
        marks: &mut Marks,
        [b, c]: [u32; 2],
        start: Local,
        last: Local,
    ) -> bool {
        let ahead = |axis: usize, at: u32| match last[axis] < start[axis] {
            true => at.wrapping_sub(last[axis]),
            false => last[axis].wrapping_sub(at),
        };
        let (ahead_b, ahead_c) = (ahead(B, b), ahead(C, c));
        if ahead_b > 1 || ahead_c > 1 {
            return false;
        }
        if ahead_b + ahead_c > 0 {
            mark_voxel::<A, B, C>(marks, last[A], b, c);
        }
        if ahead_b + ahead_c == 2 {
            match self.crosses_first::<B, C>(marks.window().base(), b.max(last[B]), c.max(last[C])) {
                true => mark_voxel::<A, B, C>(marks, last[A], last[B], c),
                false => mark_voxel::<A, B, C>(marks, last[A], b, last[C]),
            }
        }
        true
    }

    /// Whether the border below voxel `b` along `B` is crossed before the border below voxel `c` along `C`, by the
    /// closed form; of equal times the lower axis is first, and `B` is lower.
    fn crosses_first<const B: usize, const C: usize>(&self, base: VoxelIndex, b: u32, c: u32) -> bool {
        let time = |axis: usize, border: u32| {
            let inv_direction = 1.0 / (self.end[axis] - self.origin[axis]);
            (f64::from(base[axis]) + f64::from(border) - self.origin[axis]) * inv_direction
        };
        time(B, b) <= time(C, c)
    }
}

/// Where a ray crosses from one slab to the next, in units of 2^-32 voxels relative to the window's lowest voxel.
struct Path {
    at_b: i64,
    at_c: i64,
    slope_b: i64,
    slope_c: i64,
}

impl Path {
    /// The first crossing of a ray that starts in slab `a`, and what is added from crossing to crossing.
    #[inline]
    fn along<const A: usize, const B: usize, const C: usize>(
        ray: &SlabRay,
        base: VoxelIndex,
        a: u32,
        is_up: bool,
    ) -> Self {
        let per_slab = 1.0 / (ray.end[A] - ray.origin[A]).abs();
        let first = (f64::from(base[A]) + f64::from(a) + f64::from(is_up) - ray.origin[A]).abs();
        let slope = |axis: usize| (ray.end[axis] - ray.origin[axis]) * per_slab;
        let at = |axis: usize| ray.origin[axis] - f64::from(base[axis]) + first * slope(axis);
        // Added to a number below 2^51, this leaves its nearest whole number in the lowest bits.
        const ROUND: f64 = 1.5 * (1_u64 << 52) as f64;
        let fixed = |voxels: f64| {
            (voxels * (1_u64 << 32) as f64 + ROUND).to_bits().wrapping_sub(ROUND.to_bits()) as i64
        };
        Self { at_b: fixed(at(B)), at_c: fixed(at(C)), slope_b: fixed(slope(B)), slope_c: fixed(slope(C)) }
    }

    /// Goes to the next crossing.
    #[inline]
    fn advance(&mut self) {
        self.at_b += self.slope_b;
        self.at_c += self.slope_c;
    }

    /// Whether the border along `B` was crossed before the one along `C`, in a slab in which both were crossed; `None`
    /// if they are too near to each other to tell without the closed form.
    #[inline]
    fn is_b_crossed_first(&self) -> Option<bool> {
        // How far the ray is past its border, by how steep it is, is how long ago that was.
        let past = |at: i64, slope: i64| u64::from(if slope < 0 { !at as u32 } else { at as u32 });
        let b = past(self.at_b, self.slope_b) * self.slope_c.unsigned_abs();
        let c = past(self.at_c, self.slope_c) * self.slope_b.unsigned_abs();
        (b.abs_diff(c) > NEAR_EDGE).then_some(b > c)
    }
}

#[inline]
fn is_near_border(position: i64) -> bool {
    (position as u32).wrapping_add(NEAR_BORDER) < 2 * NEAR_BORDER
}

fn mark_voxel<const A: usize, const B: usize, const C: usize>(marks: &mut Marks, a: u32, b: u32, c: u32) {
    let slot = marks.slot_of(voxel::<A, B, C>(a, b, c));
    marks.slabs(slot, A)[(a & 7) as usize] |= slab_bit(b, c);
}

/// The voxel with these indices along the axes `A`, `B` and `C`.
#[inline]
fn voxel<const A: usize, const B: usize, const C: usize>(a: u32, b: u32, c: u32) -> Local {
    let mut voxel = [0; 3];
    (voxel[A], voxel[B], voxel[C]) = (a, b, c);
    voxel
}

#[cfg(test)]
mod tests {
    use super::super::window::Window;
    use super::*;
    use crate::space::{place_of_voxel, places};
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn ray(origin: Point, end: Point) -> SlabRay {
        let voxel = |point: Point| point.map(|x| x.floor() as i32);
        SlabRay { origin, start: voxel(origin), end, last: voxel(end) }
    }

    fn marked(marks: &Marks) -> BTreeSet<VoxelIndex> {
        let mut voxels = BTreeSet::new();
        for (slot, brick) in marks.bricks().iter().enumerate() {
            let (_, passed) = marks.masks(slot);
            let passed: BTreeSet<usize> = places(passed).collect();
            for k in 0..512 {
                let offset = [k & 7, k >> 3 & 7, k >> 6];
                if passed.contains(&place_of_voxel(offset)) {
                    voxels.insert(std::array::from_fn(|axis| brick[axis] * 8 + offset[axis]));
                }
            }
        }
        voxels
    }

    fn visited(rays: &[SlabRay]) -> BTreeSet<VoxelIndex> {
        let mut voxels = BTreeSet::new();
        for ray in rays {
            ray.walk().for_each_before_end(|voxel| {
                voxels.insert(voxel);
            });
        }
        voxels
    }

    /// Marks the rays from one origin and compares with the exact walk; returns how many were left to it.
    fn check(origin: Point, ends: &[Point]) -> usize {
        let bounds = ends.iter().fold((origin, origin), |(low, high), end| {
            (std::array::from_fn(|k| low[k].min(end[k])), std::array::from_fn(|k| high[k].max(end[k])))
        });
        let rays: Vec<_> = ends.iter().map(|&end| ray(origin, end)).collect();
        let mut marks = Marks::default();
        marks.clear(Window::around(rays[0].start, bounds));
        let left: Vec<_> = rays.iter().filter(|ray| !ray.mark(&mut marks)).copied().collect();
        marks.finish();
        let (marked, visited) = (marked(&marks), visited(&rays));
        assert!(marked.is_subset(&visited), "{origin:?} to {ends:?}: more than the rays visit");
        let told = rays.iter().filter(|ray| !left.iter().any(|other| other.end == ray.end)).copied();
        let told = self::visited(&told.collect::<Vec<_>>());
        assert!(told.is_subset(&marked), "{origin:?} to {ends:?}: less than the rays visit");
        left.len()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]

        #[test]
        fn the_voxels_are_those_of_the_exact_walk(
            origin in prop::array::uniform3(-100.0..100.0_f64),
            ends in prop::collection::vec(prop::array::uniform3(-150.0..150.0_f64), 1..8),
        ) {
            check(origin, &ends);
        }

        #[test]
        fn rays_through_edges_and_corners_are_right_or_left_to_the_exact_walk(
            origin in prop::array::uniform3(-40..40_i32),
            ends in prop::collection::vec(prop::array::uniform3(-60..60_i32), 1..8),
            nudge in prop::array::uniform3(prop::sample::select(vec![0.0, 1e-7, -1e-7, 1e-12, 0.25])),
            unit in prop::sample::select(vec![1.0, 0.5, 0.25]),
        ) {
            let point = |p: [i32; 3], nudge: Point| std::array::from_fn(|k| f64::from(p[k]) * unit + nudge[k]);
            let ends: Vec<_> = ends.into_iter().map(|end| point(end, [0.0; 3])).collect();
            check(point(origin, nudge), &ends);
        }

        #[test]
        fn far_from_zero_and_for_long_rays_too(
            origin in prop::array::uniform3(-1.0e8..1.0e8_f64),
            reach in prop::array::uniform3(-1900.0..1900.0_f64),
        ) {
            check(origin, &[std::array::from_fn(|k| origin[k] + reach[k])]);
        }
    }

    #[test]
    fn a_sensor_on_a_corner_of_voxels_leaves_few_rays_to_the_exact_walk() {
        let directions = (0..1000).map(|k| {
            let (azimuth, up) = (f64::from(k) * 0.618, f64::from(k % 37) * 0.05 - 0.87);
            [3.0 + 30.0 * azimuth.cos(), -4.0 + 30.0 * azimuth.sin(), 9.0 + 20.0 * up]
        });
        let left = check([3.0, -4.0, 9.0], &directions.collect::<Vec<_>>());
        assert!(left < 5, "{left} of 1000 rays");
    }
}
