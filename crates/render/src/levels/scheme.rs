use super::node_key::NodeKey;
use voxtile::space::{Grid, TileIndex};

/// How the voxels of a map are divided into nodes.
///
/// From [`Scheme::tile_level`] on a node covers `2^k` tiles along each axis. Below, it is a block of a tile, 128 of its
/// voxels wide, the last of a row perhaps less.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Scheme {
    /// Voxels along the edge of a tile.
    tile_edge: i64,
    tile_level: u8,
}

/// Most voxels along the edge of a node.
pub(super) const MAX_EDGE: i64 = 128;

impl Scheme {
    pub(super) fn of(grid: &Grid) -> Self {
        let tile_edge = i64::from(grid.voxels_per_tile_edge());
        let mut tile_level = 0;
        while ceil_shift(tile_edge, tile_level) > MAX_EDGE {
            tile_level += 1;
        }
        Self { tile_edge, tile_level }
    }

    /// The level at which a tile is one node.
    pub(super) fn tile_level(self) -> u8 {
        self.tile_level
    }

    pub(super) fn key_of_tile(self, tile: TileIndex) -> NodeKey {
        NodeKey { level: self.tile_level, index: tile.to_array() }
    }

    /// The tile of which a node is a part, or that it is; `None` for a node of several tiles.
    pub(super) fn tile_of(self, key: NodeKey) -> Option<TileIndex> {
        let finer = self.tile_level.checked_sub(key.level)?;
        Some(key.index.map(|k| k >> finer).into())
    }

    /// The nodes of a tile: itself and all blocks of it, at every level.
    pub(super) fn nodes_of_tile(self, tile: TileIndex) -> Vec<NodeKey> {
        let mut keys = vec![self.key_of_tile(tile)];
        let mut next = 0;
        while let Some(key) = keys.get(next).copied().filter(|key| key.level > 0) {
            keys.extend(key.children().filter(|&child| self.edges(child).iter().all(|&edge| edge > 0)));
            next += 1;
        }
        keys
    }

    /// The node of a level that a voxel of a tile is in, and its place there.
    pub(super) fn node_of_voxel(self, tile: TileIndex, voxel: [i32; 3], level: u8) -> (NodeKey, [i64; 3]) {
        let index = tile.to_array();
        let own = [0, 1, 2].map(|k| (i64::from(voxel[k]) - i64::from(index[k]) * self.tile_edge) >> level);
        let finer = self.tile_level - level;
        let block = own.map(|k| (k / MAX_EDGE) as i32);
        let key = NodeKey { level, index: [0, 1, 2].map(|k| (index[k] << finer) + block[k]) };
        (key, own.map(|k| k % MAX_EDGE))
    }

    /// The lowest voxel of a node, in voxels of the map.
    pub(super) fn first_voxel(self, key: NodeKey) -> [i64; 3] {
        match self.tile_level.checked_sub(key.level) {
            Some(finer) => key.index.map(|k| {
                let block = i64::from(k & ((1 << finer) - 1));
                i64::from(k >> finer) * self.tile_edge + ((block * MAX_EDGE) << key.level)
            }),
            None => key.index.map(|k| (i64::from(k) * self.tile_edge) << (key.level - self.tile_level)),
        }
    }

    /// Voxels of the node's own size along each of its edges; 0 or less for blocks beyond the tile.
    pub(super) fn edges(self, key: NodeKey) -> [i64; 3] {
        match self.tile_level.checked_sub(key.level) {
            Some(finer) => key.index.map(|k| {
                let block = i64::from(k & ((1 << finer) - 1));
                (ceil_shift(self.tile_edge, key.level) - block * MAX_EDGE).min(MAX_EDGE)
            }),
            None => [ceil_shift(self.tile_edge, self.tile_level); 3],
        }
    }
}

/// A number of voxels, in voxels `2^level` times as wide.
fn ceil_shift(voxels: i64, level: u8) -> i64 {
    (voxels + (1 << level) - 1) >> level
}
