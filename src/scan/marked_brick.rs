use super::footprint::Footprint;
use super::slab_masks::{Slabs, add_slabs, slab_bit};
use crate::space::BrickMask;

/// Which voxels of a brick the rays of a scan pass or end in.
#[derive(Clone, Debug, Default)]
#[repr(align(64))]
pub(super) struct MarkedBrick {
    /// Passed voxels as slabs along x, along y and along z; in the end the first is a mask in Morton order.
    slabs: [Slabs; 3],
    /// Voxels in which rays end.
    pub(super) hits: BrickMask,
}

impl MarkedBrick {
    /// Adds the marks of another brick.
    pub(super) fn absorb(&mut self, other: &Self) {
        let words = self.slabs.iter_mut().chain([&mut self.hits]).flatten();
        let others = other.slabs.iter().chain([&other.hits]).flatten();
        words.zip(others).for_each(|(word, other)| *word |= other);
    }

    /// Ends the marking: puts what was passed into one mask.
    pub(super) fn finish(&mut self) {
        let mut passed = [0; 8];
        add_slabs::<0>(&self.slabs[0], &mut passed);
        add_slabs::<1>(&self.slabs[1], &mut passed);
        add_slabs::<2>(&self.slabs[2], &mut passed);
        self.slabs[0] = passed;
    }

    /// Passed voxels, whether hit or not, in Morton order; after [`MarkedBrick::finish`].
    pub(super) fn passed(&self) -> BrickMask {
        self.slabs[0]
    }
}

impl Footprint for MarkedBrick {
    /// The voxel's bit in the slab.
    type Cell = u64;

    #[inline]
    fn cell<const B: usize, const C: usize>(b: u32, c: u32) -> u64 {
        slab_bit(b, c)
    }

    #[inline]
    fn pass<const A: usize>(&mut self, slab: u32, cell: u64) {
        self.slabs[A][(slab & 7) as usize] |= cell;
    }

    #[inline]
    fn pass_through<const A: usize>(&mut self, slab: u32, entry: u64, exit: u64) {
        self.slabs[A][(slab & 7) as usize] |= entry | exit;
    }
}
