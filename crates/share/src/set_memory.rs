use super::set::{TileVoxels, VoxelSet};
use voxtile::space::{BrickCode, BrickMask, TileIndex};

/// Maximum number of bytes that the allocator adds to an allocation.
const ALLOCATION: usize = 16;

/// Size in bytes of a B-tree node of the standard library: 11 entries, 12 child pointers, one parent pointer.
const fn node_bytes<K, V>() -> usize {
    11 * (size_of::<K>() + size_of::<V>()) + 12 * size_of::<usize>() + 16 + ALLOCATION
}

/// Size of a node of bricks, in bytes.
const BRICK_NODE: usize = node_bytes::<BrickCode, BrickMask>();
/// Size of a node of tiles, in bytes.
const TILE_NODE: usize = node_bytes::<TileIndex, TileVoxels>();
/// Minimum number of entries in a node, except for the root.
const ENTRIES: usize = 5;

impl VoxelSet {
    /// Maximum memory per voxel, in bytes: the case of a voxel alone in its tile.
    pub(super) const MAX_BYTES_PER_VOXEL: usize =
        TILE_NODE.div_ceil(ENTRIES) + BRICK_NODE + BRICK_NODE / ENTRIES;

    /// Returns an upper bound on the heap memory in bytes, for nodes with the fewest entries. An isolated voxel counts
    /// as 190 bytes, of which 120 to 150 are used, or as 1300 bytes if it is alone in its tile.
    pub fn memory_bytes(&self) -> usize {
        let nodes_of_bricks = self.tiles.len() + self.bricks / ENTRIES;
        let nodes_of_tiles = self.tiles.len().div_ceil(ENTRIES);
        nodes_of_bricks * BRICK_NODE + nodes_of_tiles * TILE_NODE
    }

    /// Removes the last voxels, brick by brick, until the rest takes at most `bytes`. Returns the number of removed
    /// voxels.
    pub(super) fn cut_to_bytes(&mut self, bytes: usize) -> u64 {
        let before = self.len();
        while self.memory_bytes() > bytes {
            let last = self.tiles.last_key_value().and_then(|(&index, tile)| {
                let (&brick, _) = tile.bricks.last_key_value()?;
                Some((index, brick))
            });
            let Some((tile, brick)) = last else { break };
            self.put_brick(tile, brick, [0; 8]);
        }
        before - self.len()
    }
}
