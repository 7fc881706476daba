use super::set::{TileVoxels, VoxelSet};
use voxtile::space::{BrickCode, BrickMask, TileIndex};

/// Most bytes that the allocator adds to an allocation.
const ALLOCATION: usize = 16;

/// Bytes of a B-tree node of the standard library: 11 entries, 12 child pointers, one parent pointer.
const fn node_bytes<K, V>() -> usize {
    11 * (size_of::<K>() + size_of::<V>()) + 12 * size_of::<usize>() + 16 + ALLOCATION
}

/// A node of the bricks of a tile.
const BRICK_NODE: usize = node_bytes::<BrickCode, BrickMask>();
/// A node of the tiles.
const TILE_NODE: usize = node_bytes::<TileIndex, TileVoxels>();
/// Fewest entries of a node, except for the first of a map.
const ENTRIES: usize = 5;

impl VoxelSet {
    /// Most bytes of memory of a voxel: one that is alone in its tile.
    pub(super) const MAX_BYTES_PER_VOXEL: usize =
        TILE_NODE.div_ceil(ENTRIES) + BRICK_NODE + BRICK_NODE / ENTRIES;

    /// Upper bound of the bytes of memory on the heap, with nodes as empty as they may be. Isolated voxels count 190
    /// bytes each within a tile, of which 120 to 150 are used, and 1300 bytes if alone in a tile.
    pub fn memory_bytes(&self) -> usize {
        let nodes_of_bricks = self.tiles.len() + self.bricks / ENTRIES;
        let nodes_of_tiles = self.tiles.len().div_ceil(ENTRIES);
        nodes_of_bricks * BRICK_NODE + nodes_of_tiles * TILE_NODE
    }

    /// Removes the last voxels, brick by brick, until the rest takes at most so many bytes. Returns how many were
    /// removed.
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
