use super::runs::Runs;

/// For each voxel of a block: how many voxels inflate it, and whether it inflates others.
///
/// Counts are stored as bit planes: plane `k` holds bit `k` of the counts of all 64 voxels. Adding one to all voxels of
/// a mask is a carry across the planes. A block has as many planes as its largest count needs, usually two or three.
#[derive(Clone, Debug, Default)]
pub(super) struct Counts {
    /// Runs with 0, 1, 2 .. planes. A run contains the mask of inflating voxels, then the planes.
    runs: [Runs<u64>; MAX_PLANES + 1],
}

/// Position of the counts of a block in [`Counts`]. Without inflated voxels, the block has no planes.
// Packed, so that a block fits into 32 bytes.
#[derive(Clone, Copy, Debug, Default)]
#[repr(Rust, packed)]
pub(super) struct Tally {
    run: u32,
    planes: u8,
}

/// At most 2^16 voxels inflate one voxel: see `MAX_RADIUS_VOXELS`.
const MAX_PLANES: usize = 16;

impl Tally {
    /// Returns whether no voxel is inflated.
    #[inline]
    pub(super) fn is_empty(self) -> bool {
        self.planes == 0
    }
}

impl Counts {
    #[inline]
    fn words(&self, tally: Tally) -> &[u64] {
        let planes = usize::from(tally.planes);
        self.runs[planes].get(tally.run, planes + 1)
    }

    #[inline]
    fn words_mut(&mut self, tally: Tally) -> &mut [u64] {
        let planes = usize::from(tally.planes);
        self.runs[planes].get_mut(tally.run, planes + 1)
    }

    /// Returns the mask of voxels that at least one voxel inflates.
    #[inline]
    pub(super) fn inflated(&self, tally: Tally) -> u64 {
        if tally.is_empty() { 0 } else { self.words(tally)[1..].iter().fold(0, |any, plane| any | plane) }
    }

    /// Returns the mask of voxels that inflate others.
    #[inline]
    pub(super) fn inflating(&self, tally: Tally) -> u64 {
        if tally.is_empty() { 0 } else { self.words(tally)[0] }
    }

    /// Sets the mask of voxels that inflate others; each of them is inflated itself.
    pub(super) fn set_inflating(&mut self, tally: Tally, mask: u64) {
        match tally.is_empty() {
            true => debug_assert_eq!(mask, 0),
            false => self.words_mut(tally)[0] = mask,
        }
    }

    /// Adds one to the counts of the voxels in a non-empty mask; returns the voxels that were not inflated before.
    #[inline]
    pub(super) fn add(&mut self, tally: &mut Tally, mask: u64) -> u64 {
        if tally.is_empty() {
            *tally = Tally { run: self.runs[1].take(2), planes: 1 };
            self.words_mut(*tally).copy_from_slice(&[0, mask]);
            return mask;
        }
        let (mut carry, mut before) = (mask, 0);
        for plane in &mut self.words_mut(*tally)[1..] {
            before |= *plane;
            (*plane, carry) = (*plane ^ carry, *plane & carry);
        }
        if carry != 0 {
            self.grow(tally, carry);
        }
        mask & !before
    }

    #[cold]
    fn grow(&mut self, tally: &mut Tally, highest: u64) {
        let (old, planes) = (*tally, usize::from(tally.planes));
        let mut words = [0; MAX_PLANES + 2];
        words[..=planes].copy_from_slice(self.words(old));
        words[planes + 1] = highest;
        self.runs[planes].give(old.run);
        *tally = Tally { run: self.runs[planes + 1].take(planes + 2), planes: old.planes + 1 };
        self.words_mut(*tally).copy_from_slice(&words[..planes + 2]);
    }

    /// Subtracts one from the counts of the voxels in a mask, none of which is 0; returns the voxels that are no longer
    /// inflated.
    #[inline]
    pub(super) fn subtract(&mut self, tally: &mut Tally, mask: u64) -> u64 {
        let (mut borrow, mut after) = (mask, 0);
        for plane in &mut self.words_mut(*tally)[1..] {
            (*plane, borrow) = (*plane ^ borrow, !*plane & borrow);
            after |= *plane;
        }
        debug_assert_eq!(borrow, 0);
        if after == 0 {
            let Tally { run, planes } = std::mem::take(tally);
            self.runs[usize::from(planes)].give(run);
        }
        mask & !after
    }

    /// Returns bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        self.runs.iter().map(Runs::bytes).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::place::ones;
    use super::*;
    use proptest::prelude::*;

    fn counts_of(counts: &Counts, tally: Tally) -> [u32; 64] {
        let planes = if tally.is_empty() { &[] } else { &counts.words(tally)[1..] };
        std::array::from_fn(|place| {
            (0..planes.len()).map(|k| (planes[k] >> place & 1) as u32 * (1 << k)).sum()
        })
    }

    proptest! {
        #[test]
        fn bit_planes_count_like_integers(
            steps in prop::collection::vec((0..2_usize, any::<bool>(), any::<u64>(), 1..40_u32), 0..60),
        ) {
            let mut counts = Counts::default();
            let mut tallies = [Tally::default(); 2];
            let mut naive = [[0_u32; 64]; 2];
            for (which, is_more, mask, times) in steps {
                for _ in 0..times {
                    let (tally, naive) = (&mut tallies[which], &mut naive[which]);
                    let before: u64 = (0..64).filter(|&k| naive[k] != 0).map(|k| 1 << k).sum();
                    let mask = if is_more { mask } else { mask & before };
                    if mask == 0 {
                        continue;
                    }
                    ones(mask).for_each(|k| naive[k] = if is_more { naive[k] + 1 } else { naive[k] - 1 });
                    let after: u64 = (0..64).filter(|&k| naive[k] != 0).map(|k| 1 << k).sum();
                    let changed = if is_more { counts.add(tally, mask) } else { counts.subtract(tally, mask) };
                    prop_assert_eq!(changed, before ^ after);
                    prop_assert_eq!(counts.inflated(*tally), after);
                }
                for (tally, naive) in tallies.iter().zip(&naive) {
                    prop_assert_eq!(&counts_of(&counts, *tally), naive);
                }
            }
        }
    }

    #[test]
    fn counts_reach_the_size_of_the_largest_ball() {
        let (mut counts, mut tally) = (Counts::default(), Tally::default());
        (0..57_777).for_each(|_| _ = counts.add(&mut tally, 1 << 63 | 1));
        counts.set_inflating(tally, 5);
        assert_eq!((counts_of(&counts, tally)[63], counts_of(&counts, tally)[1]), (57_777, 0));
        (1..57_777).for_each(|_| assert_eq!(counts.subtract(&mut tally, 1 << 63 | 1), 0));
        assert_eq!(counts.inflating(tally), 5);
        counts.set_inflating(tally, 0);
        assert_eq!(counts.subtract(&mut tally, 1 << 63 | 1), 1 << 63 | 1);
        assert!(tally.is_empty());
    }
}
