use super::ray_end::RayEnd;
use super::ray_origin::RayOrigin;
use super::ray_walk::RayWalk;
use super::slab_path::SlabPath;
use super::slab_span::SlabSpan;
use super::slope::Slope;
use crate::scan::pages::{Footprint, Local, PageMap};
use crate::space::{Point, VoxelBox, VoxelIndex};

/// Ray from the origin of a scan, in units of voxels, world frame; see [`RayWalk`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct SlabRay<'a> {
    pub(crate) origin: &'a RayOrigin,
    pub(crate) end: Point,
    pub(crate) last: VoxelIndex,
    /// Vector from the origin to the end.
    pub(crate) direction: Point,
    /// Axis of the largest component; slabs are perpendicular to it.
    pub(crate) axis: usize,
    /// Inverse of the largest component; infinite if that is almost 0.
    pub(crate) per_slab: f64,
    /// Slabs to be traced.
    pub(crate) span: SlabSpan,
}

/// Maximum number of slabs of a ray that the exact walk handles one at a time. After that, it handles the rest of the
/// ray.
const MAX_WALKED: u32 = 4;

impl<'a> SlabRay<'a> {
    #[inline]
    pub(crate) fn new(origin: &'a RayOrigin, RayEnd { point: end, voxel: last, span, .. }: RayEnd) -> Self {
        let direction: Point = std::array::from_fn(|k| end[k] - origin.point[k]);
        let Slope { axis, per_slab, .. } = Slope::of(direction);
        Self { origin, end, last, direction, axis: axis as usize, per_slab, span }
    }

    /// The direction by its main axis.
    #[inline]
    pub(crate) fn slope(&self) -> Slope {
        Slope::of(self.direction)
    }

    /// Number of slabs after that of the origin.
    #[inline]
    pub(crate) fn slabs(&self) -> u32 {
        let [x, y, z]: [u32; 3] = std::array::from_fn(|k| self.last[k].abs_diff(self.origin.voxel[k]));
        // A match keeps the values in registers; an index would access memory.
        match self.axis {
            0 => x,
            1 => y,
            _ => z,
        }
    }

    /// The last slab to be traced, numbered from that of the origin.
    #[inline]
    pub(crate) fn last_slab(&self) -> u32 {
        self.slabs().min(self.span.until.saturating_sub(1))
    }

    /// Number of slabs to be traced if the first `skipped`, numbered from that of the origin, are also omitted.
    #[inline]
    pub(crate) fn slabs_after(&self, skipped: u32) -> u32 {
        self.slabs().min(self.span.until).saturating_sub(skipped.max(self.span.from))
    }

    /// The exact walk of the ray, voxel by voxel.
    pub(crate) fn walk(&self) -> RayWalk {
        RayWalk::between(self.origin.point, self.origin.voxel, self.end, self.last)
    }

    /// Visits the voxels of the ray's span by the closed form, in order and without the ray's last voxel.
    pub(crate) fn for_each_exactly(&self, visit: impl FnMut(VoxelIndex)) {
        self.for_each_from(self.origin.voxel, visit);
    }

    /// Like [`Self::for_each_exactly`], starting at a voxel that the ray visits.
    fn for_each_from(&self, from: VoxelIndex, visit: impl FnMut(VoxelIndex)) {
        let mut walk = self.walk().resumed_at(from);
        if self.span == SlabSpan::WHOLE {
            return walk.for_each_before_end(visit);
        }
        let done = from[self.axis].abs_diff(self.origin.voxel[self.axis]);
        if done >= self.span.until {
            return;
        }
        if done < self.span.from.min(self.slabs()) {
            walk.leave(&self.first_slabs(self.span.from.min(self.slabs())));
        }
        let steps = if self.span.until > self.slabs() {
            walk.steps()
        } else {
            let mut end = walk.clone();
            end.leave(&self.first_slabs(self.span.until));
            walk.steps_to(end.voxel())
        };
        walk.for_each_of_next(steps, visit);
    }

    /// Box of all voxels in the slabs from the origin's slab up to, but excluding, slab `until`.
    fn first_slabs(&self, until: u32) -> VoxelBox {
        let (mut min, mut end) = ([i32::MIN; 3], [i32::MAX; 3]);
        let at = self.origin.voxel[self.axis];
        match self.direction[self.axis] > 0.0 {
            true => end[self.axis] = at.saturating_add_unsigned(until),
            false => min[self.axis] = at.saturating_sub_unsigned(until).saturating_add(1),
        }
        VoxelBox { min, end }
    }

    /// Passes the voxels that [`RayWalk`] visits from the first up to, but excluding, the last. Voxels outside the
    /// window of the pages are passed to `pass_far`.
    ///
    /// Slabs outside the ray's span, and the first `skipped`, numbered from that of the origin, may be omitted. With
    /// `may_pass_last` the last voxel may also be passed.
    #[inline]
    pub(crate) fn pass<F: Footprint>(
        &self,
        pages: &mut PageMap<F>,
        skipped: u32,
        may_pass_last: bool,
        pass_far: impl FnMut(VoxelIndex),
    ) {
        let skipped = skipped.max(self.span.from);
        let passed = match self.axis {
            0 => self.pass_slabs::<0, 1, 2, F>(pages, skipped, may_pass_last),
            1 => self.pass_slabs::<1, 0, 2, F>(pages, skipped, may_pass_last),
            _ => self.pass_slabs::<2, 0, 1, F>(pages, skipped, may_pass_last),
        };
        if let Err(from) = passed {
            self.pass_exactly(pages, from, pass_far);
        }
    }

    /// Like [`Self::pass`], by the closed form and starting at voxel `from`.
    #[cold]
    fn pass_exactly<F: Footprint>(
        &self,
        pages: &mut PageMap<F>,
        from: VoxelIndex,
        mut pass_far: impl FnMut(VoxelIndex),
    ) {
        self.for_each_from(from, |voxel| match pages.window().local(voxel) {
            Some(near) => pages.at(near).pass::<0>(near[0], F::cell::<1, 2>(near[1], near[2])),
            None => pass_far(voxel),
        });
    }

    /// Passes the voxels in order as far as they can be determined without the closed form. The error is the first
    /// voxel that cannot.
    ///
    /// The walk advances in slabs, one voxel thick, along the axis of the ray's largest component. The crossing from
    /// slab to slab is a sum of fixed-point numbers. In a slab the ray crosses the entry voxel, the exit voxel and, if
    /// these differ along both other axes, one between them. This agrees with the closed form if no crossing is close
    /// to a border and no two are close to each other. A few slabs where this is not so, such as the first one of a
    /// sensor close to a border, are walked by the closed form.
    ///
    /// `A` is the axis of the largest component, `B` and `C` are the others, the lower first.
    fn pass_slabs<const A: usize, const B: usize, const C: usize, F: Footprint>(
        &self,
        pages: &mut PageMap<F>,
        skipped: u32,
        may_pass_last: bool,
    ) -> Result<(), VoxelIndex> {
        let base = pages.window().base();
        let last = pages.window().local(self.last).ok_or(self.origin.voxel)?;
        let start = match self.origin.is_on_border {
            true => self.leave_borders(pages)?,
            false => pages.window().local(self.origin.voxel).ok_or(self.origin.voxel)?,
        };
        let [mut a, mut b, mut c] = [start[A], start[B], start[C]];
        let unknown = |a, b, c| {
            let local = voxel::<A, B, C>(a, b, c);
            Err(std::array::from_fn(|k| base[k] + local[k] as i32))
        };
        // `leave_borders` may have moved the start by one slab.
        let left = a.abs_diff((self.origin.voxel[A] - base[A]) as u32);
        let until = self.span.until.saturating_sub(left);
        let all_slabs = last[A].abs_diff(a);
        let slabs = all_slabs.min(until);
        if slabs > 0 {
            let is_up = last[A] > a;
            let path = SlabPath::along::<A, B, C>(self, base, a, is_up);
            let mut done = skipped.saturating_sub(left).min(slabs);
            if done > 0 {
                let crossing = path.after(done - 1);
                if crossing.is_near_border() {
                    // The voxel after the skipped slabs is uncertain: skip none, so that no voxel is omitted.
                    done = 0;
                } else {
                    (b, c) = crossing.voxel();
                    a = if is_up { a + done } else { a - done };
                }
            }
            let mut walked = 0;
            while done < slabs {
                let stretch = path.stretch([a, b, c], [last[A], last[B], last[C]], done, slabs);
                let page = pages.number_at(voxel::<A, B, C>(a, b, c));
                let certain = pages.pages_mut()[page].pass_stretch::<A, B, C>(&stretch, a);
                if certain > 0 {
                    (b, c) = path.after(done + certain - 1).voxel();
                    a = if is_up { a + certain } else { a - certain };
                    done += certain;
                }
                let leaves_page = certain == stretch.slabs;
                if done == slabs || leaves_page && !stretch.leaves_sideways {
                    continue;
                }
                // The ray leaves the page within a slab, or its exit from the slab is uncertain.
                let crossing = path.after(done);
                let certain = leaves_page.then(|| Self::pass_slab::<A, B, C, F>(pages, &crossing, [a, b, c]));
                let exit = certain.flatten().or_else(|| {
                    walked += 1;
                    (walked <= MAX_WALKED).then(|| self.walk_slab::<A, B, C, F>(pages, [a, b, c]))?
                });
                let Some((exit_b, exit_c)) = exit else { return unknown(a, b, c) };
                (b, c, done) = (exit_b, exit_c, done + 1);
                a = if is_up { a + 1 } else { a - 1 };
            }
        }
        if until <= all_slabs {
            return Ok(());
        }
        let ahead = |axis: usize, at: u32| match last[axis] < start[axis] {
            true => at.wrapping_sub(last[axis]),
            false => last[axis].wrapping_sub(at),
        };
        let (ahead_b, ahead_c) = (ahead(B, b), ahead(C, c));
        if ahead_b | ahead_c > 1 {
            return unknown(a, b, c);
        }
        if may_pass_last || ahead_b | ahead_c > 0 {
            pages.at(voxel::<A, B, C>(a, b, c)).pass::<A>(a, F::cell::<B, C>(b, c));
        }
        if ahead_b & ahead_c > 0 {
            (b, c) = match self.crosses_first::<B, C>(base, b.max(last[B]), c.max(last[C])) {
                true => (last[B], c),
                false => (b, last[C]),
            };
            pages.at(voxel::<A, B, C>(a, b, c)).pass::<A>(a, F::cell::<B, C>(b, c));
        }
        Ok(())
    }

    /// Marks the voxels of a slab as passed, beginning with `[a, b, c]`, in any page. Returns the voxel through which
    /// the ray enters the next slab. If rounding makes that voxel uncertain, it marks nothing and returns `None`.
    #[inline]
    fn pass_slab<const A: usize, const B: usize, const C: usize, F: Footprint>(
        pages: &mut PageMap<F>,
        crossing: &SlabPath,
        [a, b, c]: [u32; 3],
    ) -> Option<(u32, u32)> {
        let between = crossing.between((b, c))?;
        let exit = crossing.voxel();
        let mut pass = |(b, c): (u32, u32)| {
            pages.at(voxel::<A, B, C>(a, b, c)).pass::<A>(a, F::cell::<B, C>(b, c));
        };
        pass((b, c));
        between.into_iter().for_each(&mut pass);
        if (b, c) != exit {
            pass(exit);
        }
        Some(exit)
    }

    /// Marks the voxels of a slab as passed, beginning with `[a, b, c]`, by the closed form. Returns the voxel through
    /// which the ray enters the next slab. If the ray ends before, it marks nothing and returns `None`.
    #[cold]
    fn walk_slab<const A: usize, const B: usize, const C: usize, F: Footprint>(
        &self,
        pages: &mut PageMap<F>,
        [a, b, c]: [u32; 3],
    ) -> Option<(u32, u32)> {
        let base = pages.window().base();
        let first = voxel::<A, B, C>(a, b, c);
        let mut walk = self.walk().resumed_at(std::array::from_fn(|k| base[k] + first[k] as i32));
        // Apart from rounding, a ray crosses at most one border along `B` and one along `C` in a slab.
        let mut voxels = [first; 5];
        for passed in 1..=voxels.len() {
            walk.advance();
            let next = pages.window().local(walk.voxel())?;
            if next[A] != a {
                for voxel in &voxels[..passed] {
                    pages.at(*voxel).pass::<A>(a, F::cell::<B, C>(voxel[B], voxel[C]));
                }
                return Some((next[B], next[C]));
            }
            *voxels.get_mut(passed)? = next;
        }
        None
    }

    /// Handles the crossings at time 0. An origin on a border between voxels belongs to the upper voxel, and a ray
    /// toward lower indices leaves it immediately, the lowest axis first. Returns the voxel after these crossings.
    fn leave_borders<F: Footprint>(&self, pages: &mut PageMap<F>) -> Result<Local, VoxelIndex> {
        let origin = self.origin;
        let mut voxel = pages.window().local(origin.voxel).ok_or(origin.voxel)?;
        let is_left: [bool; 3] =
            std::array::from_fn(|k| origin.is_on_border_along[k] && self.last[k] < origin.voxel[k]);
        // The closed form is undefined for a crossing of a ray that hardly moves.
        if (0..3).any(|k| is_left[k] && self.direction[k] > -f64::MIN_POSITIVE) {
            return Err(origin.voxel);
        }
        for axis in 0..3 {
            if is_left[axis] {
                pages.at(voxel).pass::<0>(voxel[0], F::cell::<1, 2>(voxel[1], voxel[2]));
                voxel[axis] -= 1;
            }
        }
        Ok(voxel)
    }

    /// Returns whether, by the closed form, the lower border of voxel `b` along `B` is crossed before that of voxel `c`
    /// along `C`. At equal times the lower axis is first, and `B` is lower.
    fn crosses_first<const B: usize, const C: usize>(&self, base: VoxelIndex, b: u32, c: u32) -> bool {
        let time = |axis: usize, border: u32| {
            let inv_direction = 1.0 / self.direction[axis];
            (f64::from(base[axis]) + f64::from(border) - self.origin.point[axis]) * inv_direction
        };
        time(B, b) <= time(C, c)
    }
}

/// Returns the voxel with these indices along the axes `A`, `B` and `C`.
#[inline]
pub(crate) fn voxel<const A: usize, const B: usize, const C: usize>(a: u32, b: u32, c: u32) -> Local {
    let mut voxel = [0; 3];
    (voxel[A], voxel[B], voxel[C]) = (a, b, c);
    voxel
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::pages::CountedPage;
    use crate::scan::pages::MarkedPage;
    use crate::scan::pages::Window;
    use crate::scan::pages::brick_in_page;
    use crate::space::place_of_voxel;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    fn voxel_of(point: Point) -> VoxelIndex {
        point.map(|x| x.floor() as i32)
    }

    /// Number of passes of each voxel.
    type Passes = BTreeMap<VoxelIndex, u32>;

    fn add(passes: &mut Passes, brick: VoxelIndex, passes_at: impl Fn(usize) -> u32) {
        for k in 0..512 {
            let offset = [k & 7, k >> 3 & 7, k >> 6];
            let count = passes_at(place_of_voxel(offset));
            if count > 0 {
                passes.insert(std::array::from_fn(|axis| brick[axis] * 8 + offset[axis]), count);
            }
        }
    }

    fn visits(rays: &[SlabRay<'_>]) -> Passes {
        let mut visits = Passes::new();
        for ray in rays {
            ray.walk().for_each_before_end(|voxel| *visits.entry(voxel).or_default() += 1);
        }
        visits
    }

    fn is_unknown(ray: &SlabRay, pages: &mut PageMap<MarkedPage>) -> bool {
        let passed = match ray.axis {
            0 => ray.pass_slabs::<0, 1, 2, _>(pages, 0, false),
            1 => ray.pass_slabs::<1, 0, 2, _>(pages, 0, false),
            _ => ray.pass_slabs::<2, 0, 1, _>(pages, 0, false),
        };
        passed.is_err()
    }

    /// Passes along the rays from one origin, and compares with the exact walk. Returns the number of rays that the
    /// slabs alone could not decide.
    fn check(origin: Point, ends: &[Point]) -> usize {
        let bounds = ends.iter().fold((origin, origin), |(low, high), end| {
            (std::array::from_fn(|k| low[k].min(end[k])), std::array::from_fn(|k| high[k].max(end[k])))
        });
        let origin = &RayOrigin::new(origin, voxel_of(origin));
        let rays: Vec<_> = ends
            .iter()
            .map(|&end| {
                SlabRay::new(
                    origin,
                    RayEnd { point: end, voxel: voxel_of(end), hit: None, span: SlabSpan::WHOLE },
                )
            })
            .collect();
        let window = Window::around(origin.voxel, bounds);
        let mut marked = PageMap::<MarkedPage>::default();
        let mut counted = PageMap::<CountedPage>::default();
        marked.clear(window, usize::MAX);
        counted.clear(window, usize::MAX);
        let unknown =
            rays.iter().filter(|ray| is_unknown(ray, &mut PageMap::<MarkedPage>::clone(&marked))).count();
        for ray in &rays {
            ray.pass(&mut marked, 0, false, |_| unreachable!("the window holds all ends"));
            ray.pass(&mut counted, 0, false, |_| unreachable!("the window holds all ends"));
        }
        let expected = visits(&rays);
        let mut passes = Passes::new();
        for (page, index) in counted.pages().iter().zip(counted.indices()) {
            let bricks: Vec<_> = page.bricks().collect();
            for (place, brick) in page.places() {
                let counts = bricks[brick];
                add(&mut passes, brick_in_page(*index, place), |place| u32::from(counts.get(place)));
            }
        }
        assert_eq!(passes, expected, "{origin:?} to {ends:?}");
        let mut passes = Passes::new();
        for (page, index) in marked.pages().iter().zip(marked.indices()) {
            for brick in page.bricks(*index) {
                add(&mut passes, brick.index, |place| (brick.passed[place / 64] >> (place % 64)) as u32 & 1);
            }
        }
        assert!(passes.keys().eq(expected.keys()), "{origin:?} to {ends:?}");
        unknown
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]

        #[test]
        fn voxels_equal_those_of_the_exact_walk(
            origin in prop::array::uniform3(-100.0..100.0_f64),
            ends in prop::collection::vec(prop::array::uniform3(-150.0..150.0_f64), 1..8),
        ) {
            check(origin, &ends);
        }

        #[test]
        fn rays_through_edges_and_corners_are_exact(
            origin in prop::array::uniform3(-40..40_i32),
            ends in prop::collection::vec(prop::array::uniform3(-60..60_i32), 1..8),
            nudge in prop::array::uniform3(prop::sample::select(vec![0.0, 1e-7, -1e-7, 5e-7, -5e-7, 1e-12, 0.25])),
            unit in prop::sample::select(vec![1.0, 0.5, 0.25]),
        ) {
            let point = |p: [i32; 3], nudge: Point| std::array::from_fn(|k| f64::from(p[k]) * unit + nudge[k]);
            let ends: Vec<_> = ends.into_iter().map(|end| point(end, [0.0; 3])).collect();
            check(point(origin, nudge), &ends);
        }

        #[test]
        fn long_rays_far_from_zero_are_exact(
            origin in prop::array::uniform3(-1.0e8..1.0e8_f64),
            reach in prop::array::uniform3(-1900.0..1900.0_f64),
        ) {
            check(origin, &[std::array::from_fn(|k| origin[k] + reach[k])]);
        }
    }

    #[test]
    fn a_sensor_on_a_voxel_corner_needs_few_exact_walks() {
        let directions = (0..1000).map(|k| {
            let (azimuth, up) = (f64::from(k) * 0.618, f64::from(k % 37) * 0.05 - 0.87);
            [3.0 + 30.0 * azimuth.cos(), -4.0 + 30.0 * azimuth.sin(), 9.0 + 20.0 * up]
        });
        let left = check([3.0, -4.0, 9.0], &directions.collect::<Vec<_>>());
        assert!(left < 5, "{left} of 1000 rays");
    }

    #[test]
    fn a_sensor_close_to_a_border_needs_few_exact_walks() {
        // 0.9 m and 1.4 m at a resolution of 0.05 m, converted from `f32`.
        let origin = [17.999999523162842, 200.0, 27.999999523162842];
        let ends = (0..1000).map(|k| {
            let (azimuth, up) = (f64::from(k) * 0.618, f64::from(k % 37) * 0.05 - 0.87);
            [origin[0] + 80.0 * azimuth.cos(), origin[1] + 80.0 * azimuth.sin(), origin[2] + 40.0 * up]
        });
        let left = check(origin, &ends.collect::<Vec<_>>());
        assert!(left < 5, "{left} of 1000 rays");
    }
}
