use super::slab_ray::SlabRay;
use crate::scan::pages::{Footprint, PAGE_EDGE, WORDS, part_of_place};
use crate::space::VoxelIndex;

const EDGE: u32 = PAGE_EDGE as u32;

/// Crossings closer than this to a voxel border, in units of 2^-32 voxels, are computed by the exact walk.
///
/// The value is 2^-18 voxels. The error of a position is below 2^-33 voxels per slab, with at most 8192 slabs to either
/// side of a window; the error of the closed form's times, rounded to `f64`, is below 2^-36 voxels.
const NEAR_BORDER: u32 = 1 << 14;

/// If two crossings in one slab are closer to each other than this, in units of 2^-32 voxels, the exact walk is used:
/// the error of a position is below 2^14 units.
const NEAR_EDGE: u64 = 1 << 16;

/// [`NEAR_BORDER`] within a page: positions there have six fewer bits, and an additional error of one unit for each of
/// the page's 64 slabs.
const NEAR_BORDER_IN_PAGE: u64 = 1 << 14;

/// Crossing of a ray from one slab to the next, in units of 2^-32 voxels relative to the window's lowest voxel.
#[derive(Clone, Copy)]
pub(crate) struct SlabPath {
    at_b: i64,
    at_c: i64,
    slope_b: i64,
    slope_c: i64,
    /// Slopes along `B` and `C` in voxels per voxel along `A`.
    slopes: [f64; 2],
    is_up: bool,
}

impl SlabPath {
    /// Returns the first crossing of a ray that starts in slab `a`, with the increment per crossing.
    #[inline]
    pub(crate) fn along<const A: usize, const B: usize, const C: usize>(
        ray: &SlabRay,
        base: VoxelIndex,
        a: u32,
        is_up: bool,
    ) -> Self {
        let origin = &ray.origin.point;
        let first = (f64::from(base[A]) + f64::from(a) + f64::from(is_up) - origin[A]).abs();
        let slope = |axis: usize| ray.direction[axis] * ray.per_slab;
        let at = |axis: usize| origin[axis] - f64::from(base[axis]) + first * slope(axis);
        // Adding this to a number below 2^51 leaves the nearest integer in the lowest bits.
        const ROUND: f64 = 1.5 * (1_u64 << 52) as f64;
        let fixed = |voxels: f64| {
            (voxels * (1_u64 << 32) as f64 + ROUND).to_bits().wrapping_sub(ROUND.to_bits()) as i64
        };
        Self {
            at_b: fixed(at(B)),
            at_c: fixed(at(C)),
            slope_b: fixed(slope(B)),
            slope_c: fixed(slope(C)),
            slopes: [slope(B), slope(C)],
            is_up,
        }
    }

    /// Returns the crossing `crossings` slabs later.
    #[inline]
    pub(crate) fn after(&self, crossings: u32) -> Self {
        let crossings = i64::from(crossings);
        let (at_b, at_c) = (self.at_b + crossings * self.slope_b, self.at_c + crossings * self.slope_c);
        Self { at_b, at_c, ..*self }
    }

    #[inline]
    pub(crate) fn voxel(&self) -> (u32, u32) {
        ((self.at_b >> 32) as u32, (self.at_c >> 32) as u32)
    }

    /// Returns the next slabs, after the first `done` of `slabs`, up to the border of the page. The ray enters the
    /// first of them through the voxel `[a, b, c]` and ends in the voxel `last`.
    #[inline]
    pub(crate) fn stretch(&self, [a, b, c]: [u32; 3], last: [u32; 3], done: u32, slabs: u32) -> Stretch {
        let first = self.after(done);
        let is_in_page = (a ^ last[0] | b ^ last[1] | c ^ last[2]) < EDGE;
        let (slabs, leaves_sideways) = match is_in_page {
            true => (slabs - done, false),
            false => first.slabs_in_page([a, b, c], slabs - done),
        };
        // Positions get as many integer bits as an index within the page has.
        let shift = EDGE.trailing_zeros();
        let local = |at: i64| (at >> shift) as u32;
        Stretch {
            at: u64::from(local(first.at_b)) << 32 | u64::from(local(first.at_c)),
            slope: ((self.slope_b >> shift) << 32).wrapping_add(self.slope_c >> shift) as u64,
            entry: (b & (EDGE - 1), c & (EDGE - 1)),
            slabs,
            leaves_sideways,
            is_up: self.is_up,
        }
    }

    /// Returns how many of the next `slabs` slabs the ray certainly passes in the page of the voxel `[a, b, c]`, and
    /// whether it leaves the page within the slab after them.
    fn slabs_in_page(&self, [a, b, c]: [u32; 3], slabs: u32) -> (u32, bool) {
        let to_end = if self.is_up { EDGE - (a & (EDGE - 1)) } else { (a & (EDGE - 1)) + 1 };
        let most = to_end.min(slabs);
        // Number of crossings that are certainly in the page, from the distance to its side.
        let crossings = |at: i64, slope: f64, index: u32| {
            let low = i64::from(index & !(EDGE - 1)) << 32;
            let high = low + (i64::from(EDGE) << 32);
            let left = if slope < 0.0 { at - low } else { high - 1 - at };
            if left < 0 {
                return 0;
            }
            let left_voxels = left as f64 * (1.0 / (1_u64 << 32) as f64);
            // The quotient is slightly reduced, so that rounding never adds a crossing.
            ((left_voxels / slope.abs() * (1.0 - 1e-6)) as u32).saturating_add(1)
        };
        let sideways = crossings(self.at_b, self.slopes[0], b).min(crossings(self.at_c, self.slopes[1], c));
        (most.min(sideways), sideways < most)
    }

    /// Returns whether the crossing is too close to a voxel border to determine its voxel without the closed form.
    #[inline]
    pub(crate) fn is_near_border(&self) -> bool {
        let is_near = |at: i64| (at as u32).wrapping_add(NEAR_BORDER) < 2 * NEAR_BORDER;
        is_near(self.at_b) || is_near(self.at_c)
    }

    /// Returns the voxel between the entry and the exit of a slab, if these differ along both axes. `None` if crossings
    /// are too close to a border, or to each other, to determine it without the closed form.
    #[inline]
    pub(crate) fn between(&self, (b, c): (u32, u32)) -> Option<Option<(u32, u32)>> {
        if self.is_near_border() {
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

/// Run of slabs that a ray passes in one page.
pub(crate) struct Stretch {
    /// Exit of the ray from the first slab, relative to the page: along `B` in the upper half, along `C` in the lower,
    /// each with as many integer bits as an index within the page has.
    at: u64,
    /// Increment from slab to slab.
    slope: u64,
    /// Voxel in the page through which the ray enters.
    entry: (u32, u32),
    pub(crate) slabs: u32,
    /// Whether the ray leaves the page within the next slab, not between slabs.
    pub(crate) leaves_sideways: bool,
    is_up: bool,
}

impl Stretch {
    /// Passes the voxels. Returns the number of slabs that are complete. If there are more slabs, the voxels of the
    /// next one are uncertain.
    #[inline]
    pub(crate) fn pass<const A: usize, const B: usize, const C: usize, F: Footprint>(
        &self,
        page: &mut F,
        mut a: u32,
    ) -> u32 {
        let bits = EDGE.trailing_zeros();
        // For both halves: bits of the fraction that are all 0 close to a border, after `near_border` is added.
        let near = NEAR_BORDER_IN_PAGE >> bits;
        let fraction = ((1_u64 << (32 - bits)) - 1) & !(2 * near - 1);
        let near_border = near << 32 | near;
        let indices = |at: u64| ((at >> (64 - bits)) as u32, (at as u32) >> (32 - bits));
        let step = if self.is_up { 1 } else { u32::MAX };
        let (mut at, mut entry) = (self.at, self.entry);
        let mut entry_cell = F::cell::<B, C>(entry.0, entry.1);
        for done in 0..self.slabs {
            let moved = at.wrapping_add(near_border);
            if moved >> 32 & fraction == 0 || moved & fraction == 0 {
                return done;
            }
            let exit = indices(at);
            // One branch that is rarely taken is faster than two that are often mispredicted.
            if (exit.0 ^ entry.0) * (exit.1 ^ entry.1) != 0 {
                let slopes = [(self.slope as i64) >> 32, self.slope as i32 as i64];
                let past = [(at >> 32 << bits) as u32, (at << bits) as u32];
                let Some(is_b_first) = is_b_crossed_first(past, slopes) else { return done };
                let between = if is_b_first { (exit.0, entry.1) } else { (entry.0, exit.1) };
                page.pass::<A>(a, F::cell::<B, C>(between.0, between.1));
            }
            let exit_cell = F::cell::<B, C>(exit.0, exit.1);
            page.pass_through::<A>(a, entry_cell, exit_cell);
            (entry, entry_cell) = (exit, exit_cell);
            a = a.wrapping_add(step);
            at = at.wrapping_add(self.slope);
        }
        self.slabs
    }

    /// Marks the voxels in the words of a page, in Morton order. Returns the number of slabs that are complete; the
    /// first voxel of the next slab may also be marked.
    ///
    /// Where the ray crosses a border between slabs it passes two voxels, which are usually bits of one word and marked
    /// together.
    // Inlined, the loop would not fit in registers.
    #[inline(never)]
    pub(crate) fn mark<const A: usize, const B: usize, const C: usize>(
        &self,
        words: &mut [u64; WORDS],
        mut a: u32,
    ) -> u32 {
        const BITS: u32 = EDGE.trailing_zeros();
        const NEAR: u64 = NEAR_BORDER_IN_PAGE >> BITS;
        const RAISED: u64 = NEAR << 32 | NEAR;
        // In a position close to a border, all these bits are 0 after `RAISED` is added.
        const FRACTION: u64 = ((1_u64 << (32 - BITS)) - 1) & !(2 * NEAR - 1);
        // The bits of an index within the page.
        const INDEX: u64 = (u32::MAX << (32 - BITS)) as u64;
        let b_of = |at: u64| (at >> (64 - BITS)) as u32;
        let c_of = |at: u64| (at as u32) >> (32 - BITS);
        let cell = |at: u64| part_of_place(B, b_of(at)) | part_of_place(C, c_of(at));
        let mut mark = |place: u32, bits: u64| words[place as usize / 64 % WORDS] |= bits << (place % 64);
        // Slabs after the current one. A `for` loop over a range would take more instructions for each slab.
        let Some(mut left) = self.slabs.checked_sub(1) else { return 0 };
        let pairs = &PAIRS[usize::from(self.is_up)][A];
        let step = if self.is_up { 1 } else { u32::MAX };
        let mut before = u64::from(self.entry.0) << (64 - BITS) | u64::from(self.entry.1) << (32 - BITS);
        let mut at = self.at.wrapping_add(RAISED);
        mark(part_of_place(A, a) | cell(before), 1);
        // Part of the Morton position for the lowest slab in the word.
        let mut part = part_of_place(A, a & !3);
        loop {
            if at & (FRACTION << 32) == 0 || at & FRACTION == 0 {
                return self.slabs - 1 - left;
            }
            // One branch that is rarely taken is faster than two that are often mispredicted.
            let differ = at ^ before;
            if (differ & INDEX << 32 != 0) & (differ & INDEX != 0) {
                let slopes = [(self.slope as i64) >> 32, self.slope as i32 as i64];
                let at = at.wrapping_sub(RAISED);
                let past = [(at >> 32 << BITS) as u32, (at << BITS) as u32];
                let Some(is_b_first) = is_b_crossed_first(past, slopes) else { return self.slabs - 1 - left };
                let (b, c) = if is_b_first { (at, before) } else { (before, at) };
                let between = part_of_place(B, b_of(b)) | part_of_place(C, c_of(c));
                mark(part_of_place(A, a) | between, 1);
            }
            if left == 0 {
                break;
            }
            left -= 1;
            let cell = cell(at);
            mark(part | cell, pairs[a as usize % 4]);
            let next = a.wrapping_add(step);
            if (a ^ next) & 4 != 0 {
                mark(part_of_place(A, next) | cell, 1);
                part = part_of_place(A, next & !3);
            }
            a = next;
            before = at;
            at = at.wrapping_add(self.slope);
        }
        mark(part_of_place(A, a) | cell(at), 1);
        self.slabs
    }
}

/// Bit of a slab in a word and, if it is in the same word, of the next slab. Indexed by whether the ray ascends, by the
/// axis `A`, and by the slab (0 to 3).
static PAIRS: [[[u64; 4]; 3]; 2] = pairs();

const fn pairs() -> [[[u64; 4]; 3]; 2] {
    let mut pairs = [[[0; 4]; 3]; 2];
    let mut axis = 0;
    while axis < 3 {
        let bits = [1_u64, 1 << (1 << axis), 1 << (8 << axis), 1 << (9 << axis)];
        pairs[0][axis] = [bits[0], bits[1] | bits[0], bits[2] | bits[1], bits[3] | bits[2]];
        pairs[1][axis] = [bits[0] | bits[1], bits[1] | bits[2], bits[2] | bits[3], bits[3]];
        axis += 1;
    }
    pairs
}

/// Returns whether a ray crossed the first of two borders, along two axes, before the second; `None` if the crossings
/// are too close to decide without the closed form. `past` are the fractions of a voxel past each lower border, in
/// units of 2^-32.
#[inline]
fn is_b_crossed_first(past: [u32; 2], slopes: [i64; 2]) -> Option<bool> {
    // Distance past the border divided by slope is the time since the crossing.
    let past = |k: usize| u64::from(if slopes[k] < 0 { !past[k] } else { past[k] });
    let b = past(0) * slopes[1].unsigned_abs();
    let c = past(1) * slopes[0].unsigned_abs();
    // The error if positions and slopes are off by one unit each.
    let near = NEAR_EDGE * slopes[0].unsigned_abs().max(slopes[1].unsigned_abs()) + (1 << 34);
    (b.abs_diff(c) > near).then_some(b > c)
}
