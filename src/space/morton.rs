use super::VoxelKey;

/// 48-bit Morton code of a voxel key: bit `3k` from x, `3k + 1` from y, `3k + 2` from z (OctoMap's child order).
///
/// Files, voxel caches and octree updates use this order. The lowest 9 bits address a voxel in its brick of 8 x 8 x 8,
/// the bits above them the brick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MortonCode(pub u64);

impl MortonCode {
    /// One more than the largest code.
    pub const END: u64 = 1 << 48;

    /// The code of a key.
    #[inline]
    pub const fn from_key(key: VoxelKey) -> Self {
        Self(spread(key.0[0]) | spread(key.0[1]) << 1 | spread(key.0[2]) << 2)
    }

    /// The key with this code.
    pub const fn to_key(self) -> VoxelKey {
        VoxelKey([gather(self.0), gather(self.0 >> 1), gather(self.0 >> 2)])
    }

    /// Returns which child (0 to 7) of the voxel's ancestor at `depth` contains the voxel. `depth` is 0 (the root) to
    /// 15.
    pub const fn child_at(self, depth: u8) -> usize {
        ((self.0 >> (45 - 3 * depth as u32)) & 7) as usize
    }

    /// Returns the smallest code in the voxel's ancestor at `depth`, which is 0 (the root) to 16 (the voxel itself).
    pub const fn ancestor(self, depth: u8) -> Self {
        Self(self.0 & !(Self::span(depth) - 1))
    }

    /// Number of voxels under a node at `depth` (0 to 16).
    pub const fn span(depth: u8) -> u64 {
        1 << (3 * (16 - depth as u32))
    }
}

/// Moves bit `k` of the input to bit `3k`.
const fn spread(bits: u16) -> u64 {
    let mut code = bits as u64;
    code = (code | code << 16) & 0x0000_0000_ff00_00ff;
    code = (code | code << 8) & 0x0000_00f0_0f00_f00f;
    code = (code | code << 4) & 0x0000_0c30_c30c_30c3;
    (code | code << 2) & EVERY_THIRD_BIT
}

/// Moves bit `3k` of the input to bit `k`.
const fn gather(code: u64) -> u16 {
    let mut bits = code & EVERY_THIRD_BIT;
    bits = (bits | bits >> 2) & 0x0000_0c30_c30c_30c3;
    bits = (bits | bits >> 4) & 0x0000_00f0_0f00_f00f;
    bits = (bits | bits >> 8) & 0x0000_0000_ff00_00ff;
    (bits | bits >> 16) as u16
}

const EVERY_THIRD_BIT: u64 = 0x0000_2492_4924_9249;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_code_of_key_1_5_3_is_167() {
        assert_eq!(MortonCode::from_key(VoxelKey([1, 5, 3])), MortonCode(167));
    }

    #[test]
    fn each_bit_of_each_axis_round_trips() {
        for axis in 0..3 {
            for bit in 0..16 {
                let mut key = [0; 3];
                key[axis] = 1 << bit;
                let code = MortonCode::from_key(VoxelKey(key));
                assert_eq!(code.0, 1 << (3 * bit + axis));
                assert_eq!(code.to_key(), VoxelKey(key));
            }
        }
        let key = VoxelKey([0xfedc, 0x0123, 0xa5c3]);
        assert_eq!(key.morton().to_key(), key);
    }

    #[test]
    fn children_are_octomaps_children() {
        // In OctoMap, bit 15 - depth of x has the weight 1, of y 2, of z 4.
        let code = MortonCode::from_key(VoxelKey([0x8000, 0x4001, 0x8001]));
        assert_eq!((code.child_at(0), code.child_at(1), code.child_at(15)), (5, 2, 6));
        assert_eq!(code.ancestor(16), code);
        assert_eq!(code.ancestor(0), MortonCode(0));
        assert_eq!(MortonCode::span(15), 8);
    }
}
