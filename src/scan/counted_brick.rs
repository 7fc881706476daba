use super::footprint::Footprint;
use crate::space::{BRICK_EDGE, BRICK_VOXELS};

/// How many rays pass each voxel of a brick, in Morton order; since the voxel was last hit.
///
/// A ray passes a voxel once at most: the counts of up to 65 535 rays fit.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct CountedBrick {
    pub(super) passes: [u16; BRICK_VOXELS],
}

/// At most so many rays are counted in a brick.
pub(super) const MAX_RAYS: usize = u16::MAX as usize;

impl Default for CountedBrick {
    fn default() -> Self {
        Self { passes: [0; BRICK_VOXELS] }
    }
}

/// The part of a voxel's place in Morton order that its index along an axis makes.
#[inline]
fn part_of_place(axis: usize, index: u32) -> u16 {
    const SPREAD: [u16; 8] = [0, 1, 8, 9, 64, 65, 72, 73];
    SPREAD[(index & 7) as usize] << axis
}

impl Footprint for CountedBrick {
    const EDGE: u32 = BRICK_EDGE as u32;

    /// The part of the voxel's place that its indices along the slab make.
    type Cell = u16;

    fn heap_bytes(&self) -> usize {
        0
    }

    #[inline]
    fn cell<const B: usize, const C: usize>(b: u32, c: u32) -> u16 {
        part_of_place(B, b) | part_of_place(C, c)
    }

    #[inline]
    fn pass<const A: usize>(&mut self, slab: u32, cell: u16) {
        self.passes[usize::from(part_of_place(A, slab) | cell)] += 1;
    }

    #[inline]
    fn pass_through<const A: usize>(&mut self, slab: u32, entry: u16, exit: u16) {
        let slab = part_of_place(A, slab);
        self.passes[usize::from(slab | entry)] += 1;
        self.passes[usize::from(slab | exit)] += u16::from(entry != exit);
    }
}
