use super::set::{TileVoxels, VoxelSet};
use crate::space::{BrickCode, BrickMask, TileIndex};

/// What the allocator adds to a piece of memory, at most.
const ALLOCATION: usize = 16;

/// Bytes of a node of a map of the standard library: room for 11 entries, 12 pointers to further nodes, one to its parent.
const fn node_bytes<K, V>() -> usize {
    11 * (size_of::<K>() + size_of::<V>()) + 12 * size_of::<usize>() + 16 + ALLOCATION
}

/// A node of the bricks of a tile.
const BRICK_NODE: usize = node_bytes::<BrickCode, BrickMask>();
/// A node of the tiles.
const TILE_NODE: usize = node_bytes::<TileIndex, TileVoxels>();
/// Entries of a node, at least, but for the first one of a map.
const ENTRIES: usize = 5;

impl VoxelSet {
    /// Bytes of memory that a voxel takes at most: one that begins a tile.
    pub(super) const MOST_BYTES_A_VOXEL: usize =
        TILE_NODE.div_ceil(ENTRIES) + BRICK_NODE + BRICK_NODE / ENTRIES;

    /// Bytes of memory on the heap, at most: what nodes take that are as empty as they may be. By voxels that lie alone
    /// it is 190 bytes each within a tile, of which 120 to 150 are taken, and 1300 for one that is alone in its tile.
    pub fn memory_bytes(&self) -> usize {
        let nodes_of_bricks = self.tiles.len() + self.bricks / ENTRIES;
        let nodes_of_tiles = self.tiles.len().div_ceil(ENTRIES);
        nodes_of_bricks * BRICK_NODE + nodes_of_tiles * TILE_NODE
    }

    /// Takes the last voxels out, brick by brick, until the rest takes no more than so many bytes. Returns how many
    /// voxels that were.
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
