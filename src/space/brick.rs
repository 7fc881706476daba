use super::{MortonCode, VoxelIndex, VoxelKey};

/// Voxels along the edge of a brick.
pub const BRICK_EDGE: i32 = 8;

/// Voxels in a brick.
pub const BRICK_VOXELS: usize = 512;

/// Brick of 8 x 8 x 8 voxels aligned to the octree, addressed by the upper 39 bits of their Morton code.
///
/// Bricks are aligned to keys, not to tiles: a brick on the border of two tiles exists in both, each with its own
/// voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BrickCode(pub u64);

/// Set of voxels of one brick: bit `b % 64` of word `b / 64` for the voxel at position `b` of the brick's Morton order.
pub type BrickMask = [u64; 8];

impl BrickCode {
    /// One more than the largest code.
    pub const END: u64 = MortonCode::END >> 9;

    /// The brick that contains a voxel.
    pub const fn of_voxel(voxel: VoxelIndex) -> Self {
        VoxelKey::from_index(voxel).morton().brick()
    }

    /// The voxel at a position (0 to 511) of the brick's Morton order.
    pub const fn voxel(self, place: usize) -> MortonCode {
        MortonCode(self.0 << 9 | place as u64)
    }
}

impl MortonCode {
    /// The brick that contains this voxel.
    #[inline]
    pub const fn brick(self) -> BrickCode {
        BrickCode(self.0 >> 9)
    }

    /// The voxel's position (0 to 511) in its brick's Morton order.
    #[inline]
    pub const fn place_in_brick(self) -> usize {
        (self.0 & 511) as usize
    }
}

/// A voxel's position (0 to 511) in its brick's Morton order.
#[inline]
pub const fn place_of_voxel(voxel: VoxelIndex) -> usize {
    const SPREAD: [u16; 8] = [0, 1, 8, 9, 64, 65, 72, 73];
    // Keys and indices agree in their lowest three bits.
    let [x, y, z] = voxel;
    (SPREAD[(x & 7) as usize] | SPREAD[(y & 7) as usize] << 1 | SPREAD[(z & 7) as usize] << 2) as usize
}

/// Returns whether a set contains the voxel at a position (0 to 511).
#[inline]
pub const fn is_in_mask(mask: &BrickMask, place: usize) -> bool {
    mask[place / 64] >> (place % 64) & 1 == 1
}

/// Adds the voxel at a position (0 to 511) to a set.
#[inline]
pub const fn add_to_mask(mask: &mut BrickMask, place: usize) {
    mask[place / 64] |= 1 << (place % 64);
}

/// The positions of the set bits, in ascending order.
#[inline]
pub fn ones(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let place = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (place < 64).then_some(place)
    })
}

/// Mask of a brick's voxels that satisfy `min <= local < end` along each axis, each in 0..=8.
pub fn mask_of_box(min: [i32; 3], end: [i32; 3]) -> BrickMask {
    let below = |axis: usize, k: i32| &BELOW[axis][k.clamp(0, BRICK_EDGE) as usize];
    let mut mask = [u64::MAX; 8];
    for axis in 0..3 {
        let (low, high) = (below(axis, min[axis]), below(axis, end[axis]));
        (0..8).for_each(|word| mask[word] &= high[word] & !low[word]);
    }
    mask
}

/// For each axis and `k` from 0 to 8, the mask of the voxels whose index along the axis is below `k`.
static BELOW: [[BrickMask; 9]; 3] = below_masks();

const fn below_masks() -> [[BrickMask; 9]; 3] {
    let mut masks = [[[0; 8]; 9]; 3];
    let mut code = 0;
    while code < BRICK_VOXELS {
        // `code` only enumerates the voxels; it is not a Morton position.
        let voxel = [code as i32 & 7, code as i32 >> 3 & 7, code as i32 >> 6];
        let place = place_of_voxel(voxel);
        let mut axis = 0;
        while axis < 3 {
            let mut k = voxel[axis] as usize + 1;
            while k <= 8 {
                add_to_mask(&mut masks[axis][k], place);
                k += 1;
            }
            axis += 1;
        }
        code += 1;
    }
    masks
}

/// The positions in a mask, in ascending order.
pub fn places(mask: BrickMask) -> impl Iterator<Item = usize> {
    mask.into_iter().enumerate().flat_map(|(word, mut bits)| {
        std::iter::from_fn(move || {
            let bit = bits.trailing_zeros() as usize;
            bits &= bits.wrapping_sub(1);
            (bit < 64).then_some(word * 64 + bit)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brick_and_position_form_the_morton_code() {
        for voxel in [[0, 0, 0], [-1, -8, 7], [12345, -23456, 32767], [-32768, 63, 64]] {
            let code = VoxelKey::from_index(voxel).morton();
            assert_eq!(code.place_in_brick(), place_of_voxel(voxel));
            assert_eq!(BrickCode::of_voxel(voxel).voxel(place_of_voxel(voxel)), code);
        }
    }

    #[test]
    fn masks_contain_the_added_voxels() {
        assert_eq!(mask_of_box([0; 3], [8; 3]), [u64::MAX; 8]);
        assert_eq!(mask_of_box([3; 3], [3; 3]), [0; 8]);
        let voxels = places(mask_of_box([2, -5, 6], [5, 1, 9])).collect::<Vec<_>>();
        let mut expected = [2, 3, 4].map(|x| [6, 7].map(|z| place_of_voxel([x, 0, z]))).concat();
        expected.sort_unstable();
        assert_eq!(voxels, expected);
        assert_eq!(places(mask_of_box([0; 3], [2; 3])).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(places(mask_of_box([7; 3], [99; 3])).collect::<Vec<_>>(), [511]);
        assert_eq!(places([0; 8]).count(), 0);
    }
}
