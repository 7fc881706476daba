use crate::space::VoxelIndex;

/// Which of the 4 x 4 x 4 cells of its parent a cell is, by the lowest two bits along each axis.
#[inline]
pub(super) fn place_of([x, y, z]: VoxelIndex) -> usize {
    (x & 3 | (y & 3) << 2 | (z & 3) << 4) as usize
}

/// The cell at a place of its parent.
#[inline]
pub(super) fn cell_at(parent: VoxelIndex, place: usize) -> VoxelIndex {
    let place = place as i32;
    [parent[0] << 2 | place & 3, parent[1] << 2 | place >> 2 & 3, parent[2] << 2 | place >> 4]
}

/// The places of a mask, ascending.
#[inline]
pub(super) fn ones(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (place < 64).then_some(place)
    })
}
