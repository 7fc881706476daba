use crate::scan::ray::Stretch;

/// What rays write to a page of voxels.
///
/// A page is divided into slabs, one voxel thick, along an axis `A`; `B` and `C` are the other axes, the lower first. A
/// voxel is given by its slab and by its [`Footprint::Cell`] in the slab. Only the lowest six bits of an index count.
pub(crate) trait Footprint: Default {
    /// A voxel of a slab.
    type Cell: Copy;

    /// Bytes of memory on the heap.
    fn heap_bytes(&self) -> usize;

    /// An empty page that takes little memory while few rays cross it.
    fn sparse() -> Self {
        Self::default()
    }

    /// This page, emptied, with its memory kept; `None` if that is not worth it.
    fn cleared(self) -> Option<Self> {
        None
    }

    /// The voxel of a slab with these indices along `B` and `C`.
    fn cell<const B: usize, const C: usize>(b: u32, c: u32) -> Self::Cell;

    /// A ray passes a voxel.
    fn pass<const A: usize>(&mut self, slab: u32, cell: Self::Cell);

    /// A ray enters a slab by one voxel and leaves it by another, or by the same.
    fn pass_through<const A: usize>(&mut self, slab: u32, entry: Self::Cell, exit: Self::Cell);

    /// A ray passes the slabs of a stretch from slab `a` on. Returns the number of slabs for which that is certain.
    #[inline]
    fn pass_stretch<const A: usize, const B: usize, const C: usize>(
        &mut self,
        stretch: &Stretch,
        a: u32,
    ) -> u32 {
        stretch.pass::<A, B, C, Self>(self, a)
    }
}
