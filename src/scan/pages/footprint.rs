use crate::scan::ray::Stretch;

/// What rays leave in a page of voxels.
///
/// A page is looked at as slabs, one voxel thick, along an axis `A`; `B` and `C` are the other axes, the lower first.
/// A voxel is given by its slab and by a [`Footprint::Cell`] of the slab. Of indices only the lowest six bits count.
pub(crate) trait Footprint: Default {
    /// A voxel of a slab.
    type Cell: Copy;

    /// Bytes of memory on the heap.
    fn heap_bytes(&self) -> usize;

    /// A page without rays that takes little memory while few rays come.
    fn sparse() -> Self {
        Self::default()
    }

    /// A page without rays in the memory of this one; `None` if that is not worth keeping.
    fn cleared(self) -> Option<Self> {
        None
    }

    /// The voxel of a slab with these indices along `B` and `C`.
    fn cell<const B: usize, const C: usize>(b: u32, c: u32) -> Self::Cell;

    /// A ray passes a voxel.
    fn pass<const A: usize>(&mut self, slab: u32, cell: Self::Cell);

    /// A ray comes into a slab by one voxel and goes out by another, or by the same.
    fn pass_through<const A: usize>(&mut self, slab: u32, entry: Self::Cell, exit: Self::Cell);

    /// A ray passes the slabs of a stretch from slab `a` on; returns in how many that is certain.
    #[inline]
    fn pass_stretch<const A: usize, const B: usize, const C: usize>(
        &mut self,
        stretch: &Stretch,
        a: u32,
    ) -> u32 {
        stretch.pass::<A, B, C, Self>(self, a)
    }
}
