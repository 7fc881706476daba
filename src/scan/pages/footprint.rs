use crate::scan::ray::Stretch;

/// Page of voxels that rays write to.
///
/// A page is divided into slabs, one voxel thick, along an axis `A`; `B` and `C` are the other axes, the lower first. A
/// voxel is addressed by its slab and its [`Footprint::Cell`] in the slab. Only the lowest six bits of an index are
/// used.
pub(crate) trait Footprint: Default {
    /// Voxel of a slab.
    type Cell: Copy;

    fn heap_bytes(&self) -> usize;

    /// Creates an empty page that takes little memory while few rays cross it.
    fn sparse() -> Self {
        Self::default()
    }

    /// Clears the page and keeps its memory; `None` if keeping it is not worthwhile.
    fn cleared(self) -> Option<Self> {
        None
    }

    /// The voxel of a slab with these indices along `B` and `C`.
    fn cell<const B: usize, const C: usize>(b: u32, c: u32) -> Self::Cell;

    /// Records a ray that passes a voxel.
    fn pass<const A: usize>(&mut self, slab: u32, cell: Self::Cell);

    /// Records a ray that enters a slab through one voxel and leaves it through another or the same one.
    fn pass_through<const A: usize>(&mut self, slab: u32, entry: Self::Cell, exit: Self::Cell);

    /// Records a ray that passes a stretch of slabs from slab `a` on. Returns the number of slabs that are complete.
    /// The stretch ends early at a slab whose voxels are uncertain because of rounding.
    #[inline]
    fn pass_stretch<const A: usize, const B: usize, const C: usize>(
        &mut self,
        stretch: &Stretch,
        a: u32,
    ) -> u32 {
        stretch.pass::<A, B, C, Self>(self, a)
    }
}
