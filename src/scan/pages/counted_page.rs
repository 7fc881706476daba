use super::footprint::Footprint;
use super::sparse_page::{BrickContent, SparsePage, part_of_place};
use crate::space::BRICK_VOXELS;

/// For each voxel of a page, the number of rays that passed it since it was last hit.
pub(crate) type CountedPage = SparsePage<Counts>;

/// The count of each voxel of a brick, in Morton order. A ray passes a voxel at most once, so 65 535 rays fit.
pub(crate) type Counts = [u16; BRICK_VOXELS];

/// Most rays that a page can count.
pub(crate) const MAX_RAYS: usize = u16::MAX as usize;

impl BrickContent for Counts {
    const EMPTY: Self = [0; BRICK_VOXELS];
}

impl CountedPage {
    /// The count of the voxel at a place.
    #[inline]
    pub(crate) fn count(&mut self, place: u32) -> &mut u16 {
        &mut self.brick(place)[place as usize % BRICK_VOXELS]
    }
}

impl Footprint for CountedPage {
    /// The part of the voxel's place that comes from its indices along the slab.
    type Cell = u32;

    fn heap_bytes(&self) -> usize {
        self.bricks_bytes()
    }

    fn cleared(self) -> Option<Self> {
        Some(self.emptied())
    }

    #[inline]
    fn cell<const B: usize, const C: usize>(b: u32, c: u32) -> u32 {
        part_of_place(B, b) | part_of_place(C, c)
    }

    #[inline]
    fn pass<const A: usize>(&mut self, slab: u32, cell: u32) {
        *self.count(part_of_place(A, slab) | cell) += 1;
    }

    #[inline]
    fn pass_through<const A: usize>(&mut self, slab: u32, entry: u32, exit: u32) {
        let slab = part_of_place(A, slab);
        *self.count(slab | entry) += 1;
        *self.count(slab | exit) += u16::from(entry != exit);
    }
}
