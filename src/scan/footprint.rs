/// What rays leave in a block of voxels.
///
/// A block is looked at as slabs, one voxel thick, along an axis `A`; `B` and `C` are the other axes, the lower first.
/// A voxel is given by its slab and by a [`Footprint::Cell`] of the slab.
pub(super) trait Footprint: Default {
    /// Voxels along the edge of a block, a power of two. Of indices only the bits below it count.
    const EDGE: u32;

    /// A voxel of a slab.
    type Cell: Copy;

    /// Bytes of memory on the heap.
    fn heap_bytes(&self) -> usize;

    /// The voxel of a slab with these indices along `B` and `C`.
    fn cell<const B: usize, const C: usize>(b: u32, c: u32) -> Self::Cell;

    /// A ray passes a voxel.
    fn pass<const A: usize>(&mut self, slab: u32, cell: Self::Cell);

    /// A ray comes into a slab by one voxel and goes out by another, or by the same.
    fn pass_through<const A: usize>(&mut self, slab: u32, entry: Self::Cell, exit: Self::Cell);
}
