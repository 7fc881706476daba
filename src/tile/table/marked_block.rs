use super::brick_directory::BLOCK_EDGE;
use crate::space::{BRICK_EDGE, VoxelBox, VoxelIndex};

/// Block of 4 x 4 x 4 bricks of a tile, some of which may contain occupied voxels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MarkedBlock {
    /// Lowest voxel, which may be outside of the tile.
    pub(crate) min: VoxelIndex,
    /// One bit for each brick, in Morton order: whether it may contain occupied voxels.
    pub(crate) marks: u64,
    /// Number of the block in the tile's directory.
    pub(super) number: u32,
}

impl MarkedBlock {
    /// All voxels of the block.
    pub(crate) fn voxels(&self) -> VoxelBox {
        VoxelBox { min: self.min, end: self.min.map(|k| k.saturating_add(BLOCK_EDGE)) }
    }

    /// Lowest voxel of the brick at a position of the block.
    pub(crate) fn lowest_of(&self, place: usize) -> VoxelIndex {
        std::array::from_fn(|k| {
            // Two bits per coordinate, interleaved.
            let steps = (place >> k & 1) | (place >> (k + 3) & 1) << 1;
            self.min[k].saturating_add(BRICK_EDGE * steps as i32)
        })
    }
}
