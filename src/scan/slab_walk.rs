use super::block_map::BlockMap;
use super::footprint::Footprint;
use super::ray::RayWalk;
use super::window::Local;
use crate::space::{Point, VoxelIndex};

/// A crossing nearer than this to a border between voxels, in units of 2^-32 voxels, is left to the exact walk.
///
/// That is 2^-20 voxels. A position is off by less than 2^-33 voxels a slab, of which a window has 2048 to either
/// side, and the closed form's times, rounded to `f64`, by less than 2^-38 voxels.
const NEAR_BORDER: u32 = 1 << 12;

/// Two crossings in one slab that are nearer to each other than this, in units of 2^-32 voxels, are left to the exact
/// walk: a position is off by less than 2^13 of them.
const NEAR_EDGE: u64 = 1 << 15;

/// The same in a block, in units of 2^-32 voxels: positions there have six bits less, and are off by one of these more
/// for each slab of the block, which has 64 at most.
const NEAR_BORDER_IN_BLOCK: u64 = 1 << 13;

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

    /// Passes the voxels that [`RayWalk`] visits from the first up to, not including, the last.
    pub(super) fn pass<F: Footprint>(&self, blocks: &mut BlockMap<F>) {
        if let Err(from) = self.pass_slabs(blocks) {
            let mut is_left = true;
            self.walk().for_each_before_end(|voxel| {
                is_left &= voxel != from;
                if !is_left {
                    let slot = blocks.slot_of(voxel);
                    let [x, y, z] = voxel.map(|k| k as u32);
                    blocks.blocks_mut()[slot].pass::<0>(x, F::cell::<1, 2>(y, z));
                }
            });
        }
    }

    /// Passes the voxels from the first on, in order, as far as they can be told without the closed form. The error is
    /// the first that cannot.
    ///
    /// The walk goes in slabs, one voxel thick, along the axis of the ray's longest part. Where the ray crosses from
    /// slab to slab is a sum of fixed-point numbers, and the voxels it meets in a slab are the one it comes in by, the
    /// one it goes out by and, if these differ along both other axes, the one between them. That this is what the
    /// closed form says is certain as long as no crossing is next to a border, and no two are next to each other.
    fn pass_slabs<F: Footprint>(&self, blocks: &mut BlockMap<F>) -> Result<(), VoxelIndex> {
        let length: Point = std::array::from_fn(|k| (self.end[k] - self.origin[k]).abs());
        if length[0] >= length[1] && length[0] >= length[2] {
            self.pass_along::<0, 1, 2, F>(blocks)
        } else if length[1] >= length[2] {
            self.pass_along::<1, 0, 2, F>(blocks)
        } else {
            self.pass_along::<2, 0, 1, F>(blocks)
        }
    }

    /// `A` is the axis of the longest part, `B` and `C` are the others, the lower first.
    fn pass_along<const A: usize, const B: usize, const C: usize, F: Footprint>(
        &self,
        blocks: &mut BlockMap<F>,
    ) -> Result<(), VoxelIndex> {
        let base = blocks.window().base();
        let last = blocks.window().local(self.last).ok_or(self.start)?;
        let start = self.leave_borders(blocks)?;
        let [mut a, mut b, mut c] = [start[A], start[B], start[C]];
        let unknown = |a, b, c| {
            let local = voxel::<A, B, C>(a, b, c);
            Err(std::array::from_fn(|k| base[k] + local[k] as i32))
        };
        let slabs = last[A].abs_diff(a);
        if slabs > 0 {
            let is_up = last[A] > a;
            let path = Path::along::<A, B, C>(self, base, a, is_up);
            let mut done = 0;
            while done < slabs {
                let stretch = path.stretch::<F>([a, b, c], done, slabs, is_up);
                let block = blocks.at(voxel::<A, B, C>(a, b, c));
                let certain = stretch.pass::<A, B, C, F>(block, a);
                if certain > 0 {
                    (b, c) = path.after(done + certain - 1).voxel();
                    a = if is_up { a + certain } else { a - certain };
                    done += certain;
                }
                if certain < stretch.slabs {
                    return unknown(a, b, c);
                }
                if done == slabs || !stretch.leaves_sideways {
                    continue;
                }
                // The ray leaves the block in the midst of a slab.
                let crossing = path.after(done);
                let (exit_b, exit_c) = crossing.voxel();
                let Some(between) = crossing.between((b, c)) else { return unknown(a, b, c) };
                let mut pass = |(b, c): (u32, u32)| {
                    blocks.at(voxel::<A, B, C>(a, b, c)).pass::<A>(a, F::cell::<B, C>(b, c));
                };
                pass((b, c));
                between.into_iter().for_each(&mut pass);
                if (b, c) != (exit_b, exit_c) {
                    pass((exit_b, exit_c));
                }
                (b, c, done) = (exit_b, exit_c, done + 1);
                a = if is_up { a + 1 } else { a - 1 };
            }
        }
        match self.before_last::<B, C>(base, (b, c), start, last) {
            Some(cells) => {
                for (b, c) in cells.into_iter().flatten() {
                    blocks.at(voxel::<A, B, C>(a, b, c)).pass::<A>(a, F::cell::<B, C>(b, c));
                }
                Ok(())
            }
            None => unknown(a, b, c),
        }
    }

    /// The crossings at time 0: an origin on a border between voxels belongs to the upper one, and a ray downward
    /// leaves it at once, the lowest axis first. Returns the voxel after them.
    #[inline]
    fn leave_borders<F: Footprint>(&self, blocks: &mut BlockMap<F>) -> Result<Local, VoxelIndex> {
        let mut voxel = blocks.window().local(self.start).ok_or(self.start)?;
        let is_left = |axis: usize| {
            self.last[axis] < self.start[axis] && f64::from(self.start[axis]) == self.origin[axis]
        };
        // The closed form has no number for a crossing of a ray that hardly moves.
        if (0..3).any(|axis| is_left(axis) && self.end[axis] - self.origin[axis] > -f64::MIN_POSITIVE) {
            return Err(self.start);
        }
        for axis in (0..3).filter(|&axis| is_left(axis)) {
            blocks.at(voxel).pass::<0>(voxel[0], F::cell::<1, 2>(voxel[1], voxel[2]));
            voxel[axis] -= 1;
        }
        Ok(voxel)
    }

    /// The voxels of the last slab before the last voxel, at most two; the ray comes into the slab by `(b, c)`. `None`
    /// if it cannot get from there to the last.
    #[inline]
    fn before_last<const B: usize, const C: usize>(
        &self,
        base: VoxelIndex,
        (b, c): (u32, u32),
        start: Local,
        last: Local,
    ) -> Option<[Option<(u32, u32)>; 2]> {
        let ahead = |axis: usize, at: u32| match last[axis] < start[axis] {
            true => at.wrapping_sub(last[axis]),
            false => last[axis].wrapping_sub(at),
        };
        match (ahead(B, b), ahead(C, c)) {
            (0, 0) => Some([None, None]),
            (0 | 1, 0 | 1) if b == last[B] || c == last[C] => Some([Some((b, c)), None]),
            (1, 1) => match self.crosses_first::<B, C>(base, b.max(last[B]), c.max(last[C])) {
                true => Some([Some((b, c)), Some((last[B], c))]),
                false => Some([Some((b, c)), Some((b, last[C]))]),
            },
            _ => None,
        }
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
#[derive(Clone, Copy)]
struct Path {
    at_b: i64,
    at_c: i64,
    slope_b: i64,
    slope_c: i64,
    /// Slabs for a voxel along `B` and `C`, infinite for slopes of 0.
    slabs_per_voxel: [f64; 2],
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
        let direction: Point = std::array::from_fn(|k| ray.end[k] - ray.origin[k]);
        let per_slab = 1.0 / direction[A].abs();
        let first = (f64::from(base[A]) + f64::from(a) + f64::from(is_up) - ray.origin[A]).abs();
        let slope = |axis: usize| direction[axis] * per_slab;
        let at = |axis: usize| ray.origin[axis] - f64::from(base[axis]) + first * slope(axis);
        // Added to a number below 2^51, this leaves its nearest whole number in the lowest bits.
        const ROUND: f64 = 1.5 * (1_u64 << 52) as f64;
        let fixed = |voxels: f64| {
            (voxels * (1_u64 << 32) as f64 + ROUND).to_bits().wrapping_sub(ROUND.to_bits()) as i64
        };
        Self {
            at_b: fixed(at(B)),
            at_c: fixed(at(C)),
            slope_b: fixed(slope(B)),
            slope_c: fixed(slope(C)),
            slabs_per_voxel: [B, C].map(|axis| (direction[A] / direction[axis]).abs()),
        }
    }

    /// The crossing after so many others.
    #[inline]
    fn after(&self, crossings: u32) -> Self {
        let crossings = i64::from(crossings);
        let (at_b, at_c) = (self.at_b + crossings * self.slope_b, self.at_c + crossings * self.slope_c);
        Self { at_b, at_c, ..*self }
    }

    /// Indices of the voxels along `B` and `C`.
    #[inline]
    fn voxel(&self) -> (u32, u32) {
        ((self.at_b >> 32) as u32, (self.at_c >> 32) as u32)
    }

    /// The slabs after `done` others that the ray passes in the block of `[a, b, c]`, by which it comes into the first.
    #[inline]
    fn stretch<F: Footprint>(&self, [a, b, c]: [u32; 3], done: u32, slabs: u32, is_up: bool) -> Stretch {
        let first = self.after(done);
        let to_end = if is_up { F::EDGE - (a & (F::EDGE - 1)) } else { (a & (F::EDGE - 1)) + 1 };
        let most = to_end.min(slabs - done);
        // How many crossings are in the block for certain, by how far its side is away.
        let crossings = |at: i64, slope: i64, index: u32, per_voxel: f64| {
            let low = i64::from(index & !(F::EDGE - 1)) << 32;
            let high = low + (i64::from(F::EDGE) << 32);
            let left = if slope < 0 { at - low } else { high - 1 - at };
            if left < 0 {
                return 0;
            }
            // A little less, so that rounding does not make it one too many.
            ((left as f64 * (1.0 / (1_u64 << 32) as f64) * per_voxel * (1.0 - 1e-6)) as u32).saturating_add(1)
        };
        let [b_per_voxel, c_per_voxel] = self.slabs_per_voxel;
        let sideways = crossings(first.at_b, self.slope_b, b, b_per_voxel).min(crossings(
            first.at_c,
            self.slope_c,
            c,
            c_per_voxel,
        ));
        // As many bits before the point as an index in the block has.
        let shift = F::EDGE.trailing_zeros();
        let local = |at: i64| (at >> shift) as u32;
        Stretch {
            at: u64::from(local(first.at_b)) << 32 | u64::from(local(first.at_c)),
            slope: ((self.slope_b >> shift) << 32).wrapping_add(self.slope_c >> shift) as u64,
            entry: (b & (F::EDGE - 1), c & (F::EDGE - 1)),
            slabs: most.min(sideways),
            leaves_sideways: sideways < most,
            is_up,
        }
    }

    /// The voxel between the one by which the ray came into a slab and the one by which it goes out, if these differ along
    /// both axes. `None` if crossings are too near to a border, or to each other, to tell without the closed form.
    #[inline]
    fn between(&self, (b, c): (u32, u32)) -> Option<Option<(u32, u32)>> {
        let is_near = |at: i64| (at as u32).wrapping_add(NEAR_BORDER) < 2 * NEAR_BORDER;
        if is_near(self.at_b) || is_near(self.at_c) {
            return None;
        }
        let (exit_b, exit_c) = self.voxel();
        if b == exit_b || c == exit_c {
            return Some(None);
        }
        let is_b_first =
            is_b_crossed_first([self.at_b as u32, self.at_c as u32], [self.slope_b, self.slope_c])?;
        Some(Some(if is_b_first { (exit_b, c) } else { (b, exit_c) }))
    }
}

/// Slabs that a ray passes in one block.
struct Stretch {
    /// Where the ray goes out of the first slab, relative to the block: along `B` in the upper half, along `C` in the
    /// lower, each with as many bits before the point as an index in the block has.
    at: u64,
    /// What is added from slab to slab.
    slope: u64,
    /// The voxel in the block by which the ray comes in.
    entry: (u32, u32),
    slabs: u32,
    /// Whether the ray leaves the block in the next slab, and not from slab to slab.
    leaves_sideways: bool,
    is_up: bool,
}

impl Stretch {
    /// Passes the voxels, and returns in how many slabs that is certain.
    #[inline]
    fn pass<const A: usize, const B: usize, const C: usize, F: Footprint>(
        &self,
        block: &mut F,
        mut a: u32,
    ) -> u32 {
        let bits = F::EDGE.trailing_zeros();
        // Of both halves, the fraction without what is next to a border.
        let near = NEAR_BORDER_IN_BLOCK >> bits;
        let fraction = ((1_u64 << (32 - bits)) - 1) & !(2 * near - 1);
        let near_border = near << 32 | near;
        let indices = |at: u64| ((at >> (64 - bits)) as u32, (at as u32) >> (32 - bits));
        let step = if self.is_up { 1 } else { u32::MAX };
        let (mut at, mut entry) = (self.at, self.entry);
        for done in 0..self.slabs {
            let moved = at.wrapping_add(near_border);
            if moved >> 32 & fraction == 0 || moved & fraction == 0 {
                return done;
            }
            let exit = indices(at);
            // One branch that is seldom taken, where two would often be guessed wrong.
            if (exit.0 ^ entry.0) * (exit.1 ^ entry.1) != 0 {
                let slopes = [(self.slope as i64) >> 32, self.slope as i32 as i64];
                let past = [(at >> 32 << bits) as u32, (at << bits) as u32];
                let Some(is_b_first) = is_b_crossed_first(past, slopes) else { return done };
                let between = if is_b_first { (exit.0, entry.1) } else { (entry.0, exit.1) };
                block.pass::<A>(a, F::cell::<B, C>(between.0, between.1));
            }
            block.pass_through::<A>(a, F::cell::<B, C>(entry.0, entry.1), F::cell::<B, C>(exit.0, exit.1));
            entry = exit;
            a = a.wrapping_add(step);
            at = at.wrapping_add(self.slope);
        }
        self.slabs
    }
}

/// Of the borders along two axes that a ray crossed, whether the first was crossed before the second; `None` if they
/// are too near to each other to tell without the closed form. `past` are the fractions of a voxel behind each border
/// below, in units of 2^-32.
#[inline]
fn is_b_crossed_first(past: [u32; 2], slopes: [i64; 2]) -> Option<bool> {
    // How far the ray is past its border, by how steep it is, is how long ago that was.
    let past = |k: usize| u64::from(if slopes[k] < 0 { !past[k] } else { past[k] });
    let b = past(0) * slopes[1].unsigned_abs();
    let c = past(1) * slopes[0].unsigned_abs();
    // What positions and slopes, by a unit each, may be off by.
    let near = NEAR_EDGE * slopes[0].unsigned_abs().max(slopes[1].unsigned_abs()) + (1 << 34);
    (b.abs_diff(c) > near).then_some(b > c)
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
    use super::super::counted_brick::CountedBrick;
    use super::super::marked_page::MarkedPage;
    use super::super::window::Window;
    use super::*;
    use crate::space::place_of_voxel;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    fn ray(origin: Point, end: Point) -> SlabRay {
        let voxel = |point: Point| point.map(|x| x.floor() as i32);
        SlabRay { origin, start: voxel(origin), end, last: voxel(end) }
    }

    /// How often each voxel was passed.
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

    fn visits(rays: &[SlabRay]) -> Passes {
        let mut visits = Passes::new();
        for ray in rays {
            ray.walk().for_each_before_end(|voxel| *visits.entry(voxel).or_default() += 1);
        }
        visits
    }

    /// Passes along the rays from one origin, and compares with the exact walk; returns how many rays the slabs could
    /// not tell all of.
    fn check(origin: Point, ends: &[Point]) -> usize {
        let bounds = ends.iter().fold((origin, origin), |(low, high), end| {
            (std::array::from_fn(|k| low[k].min(end[k])), std::array::from_fn(|k| high[k].max(end[k])))
        });
        let rays: Vec<_> = ends.iter().map(|&end| ray(origin, end)).collect();
        let window = Window::around(rays[0].start, bounds);
        let mut marked = BlockMap::<MarkedPage>::default();
        let mut counted = BlockMap::<CountedBrick>::default();
        marked.clear(window);
        counted.clear(window);
        let unknown = rays
            .iter()
            .filter(|ray| ray.pass_slabs(&mut BlockMap::<MarkedPage>::clone(&marked)).is_err())
            .count();
        for ray in &rays {
            ray.pass(&mut marked);
            ray.pass(&mut counted);
        }
        let expected = visits(&rays);
        let mut passes = Passes::new();
        for (brick, index) in counted.blocks().iter().zip(counted.indices()) {
            add(&mut passes, *index, |place| u32::from(brick.passes[place]));
        }
        assert_eq!(passes, expected, "{origin:?} to {ends:?}");
        let mut passes = Passes::new();
        for (page, index) in marked.blocks().iter().zip(marked.indices()) {
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
