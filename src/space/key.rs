use super::{MortonCode, VoxelIndex};

/// 16-bit key of a voxel along each axis, as OctoMap stores it: `(index + 32768) mod 65536`.
///
/// Inside OctoMap's range (indices -32768 to 32767) this is exactly OctoMap's key. Beyond it the key repeats every
/// 65536 voxels; the voxel's tile resolves the ambiguity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct VoxelKey(pub [u16; 3]);

impl VoxelKey {
    /// The key of a voxel index; unique within any 65536 consecutive voxels.
    #[inline]
    pub const fn from_index(index: VoxelIndex) -> Self {
        Self([key_of(index[0]), key_of(index[1]), key_of(index[2])])
    }

    /// The voxel with this key among the 65536 voxels from `min` on along each axis.
    ///
    /// If `min` is the lowest voxel of a tile, this is the voxel of that tile.
    pub const fn to_index_from(self, min: VoxelIndex) -> VoxelIndex {
        let mut index = min;
        let mut axis = 0;
        while axis < 3 {
            let offset = self.0[axis].wrapping_sub(key_of(min[axis]));
            index[axis] = min[axis].wrapping_add(offset as i32);
            axis += 1;
        }
        index
    }

    /// Morton code of the key.
    #[inline]
    pub const fn morton(self) -> MortonCode {
        MortonCode::from_key(self)
    }
}

const fn key_of(index: i32) -> u16 {
    (index as u16) ^ 0x8000
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inside_octomaps_range_the_key_is_octomaps() {
        for (index, key) in [(0, 32768), (-1, 32767), (-32768, 0), (32767, 65535), (100, 32868)] {
            assert_eq!(VoxelKey::from_index([index, 0, 0]).0[0], key);
        }
    }

    #[test]
    fn keys_convert_back_to_indices_within_any_tile() {
        for min in [-2_000_000_000, -32_800, -1, 0, 32_700, 63_781_370, 2_000_000_000] {
            for offset in [0, 1, 99, 1023] {
                let index = [min + offset, min, min + offset / 2];
                assert_eq!(VoxelKey::from_index(index).to_index_from([min; 3]), index);
            }
        }
    }
}
