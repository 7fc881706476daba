use super::node_key::NodeKey;
use voxtile::space::{Grid, TileIndex};

/// Division of the voxels of a map into nodes.
///
/// From [`Scheme::tile_level`] up, a node covers `2^k` tiles along each axis. Below, a node is a block of a tile, of
/// 128 voxels along each axis; the last block along an axis may be smaller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Scheme {
    /// Voxels along the edge of a tile.
    tile_edge: i64,
    tile_level: u8,
}

/// Maximum number of voxels along the edge of a node.
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

    /// Returns the level at which a tile is one node.
    pub(super) fn tile_level(self) -> u8 {
        self.tile_level
    }

    pub(super) fn key_of_tile(self, tile: TileIndex) -> NodeKey {
        NodeKey { level: self.tile_level, index: tile.to_array() }
    }

    /// Returns the tile that is or contains a node; `None` for a node of several tiles.
    pub(super) fn tile_of(self, key: NodeKey) -> Option<TileIndex> {
        let finer = self.tile_level.checked_sub(key.level)?;
        Some(key.index.map(|k| k >> finer).into())
    }

    /// Returns the nodes of a tile: the tile and all its blocks at every level.
    pub(super) fn nodes_of_tile(self, tile: TileIndex) -> Vec<NodeKey> {
        let mut keys = vec![self.key_of_tile(tile)];
        let mut next = 0;
        while let Some(key) = keys.get(next).copied().filter(|key| key.level > 0) {
            keys.extend(key.children().filter(|&child| self.edges(child).iter().all(|&edge| edge > 0)));
            next += 1;
        }
        keys
    }

    /// Returns the node of a level that contains a voxel of a tile, and the voxel's position in this node.
    pub(super) fn node_of_voxel(self, tile: TileIndex, voxel: [i32; 3], level: u8) -> (NodeKey, [i64; 3]) {
        let index = tile.to_array();
        let own = [0, 1, 2].map(|k| (i64::from(voxel[k]) - i64::from(index[k]) * self.tile_edge) >> level);
        let finer = self.tile_level - level;
        let block = own.map(|k| (k / MAX_EDGE) as i32);
        let key = NodeKey { level, index: [0, 1, 2].map(|k| (index[k] << finer) + block[k]) };
        (key, own.map(|k| k % MAX_EDGE))
    }

    /// Returns the voxels of a node that contain a voxel of a child: one, or more if the tile's size is not a multiple
    /// of the coarser voxel's size.
    pub(super) fn coarser(
        self,
        own: NodeKey,
        child: NodeKey,
        at: [i64; 3],
    ) -> impl Iterator<Item = [i64; 3]> {
        let (from, first, edges) = (self.first_voxel(child), self.first_voxel(own), self.edges(own));
        let width = 1 << child.level;
        let low = [0, 1, 2].map(|k| from[k] - first[k] + (at[k] << child.level));
        let [xs, ys, zs] = [0, 1, 2].map(|k| {
            let last = ((low[k] + width - 1) >> own.level).min(edges[k] - 1);
            (low[k] >> own.level)..=last
        });
        zs.flat_map(move |z| {
            let xs = xs.clone();
            ys.clone().flat_map(move |y| xs.clone().map(move |x| [x, y, z]))
        })
    }

    /// Returns the lowest voxel of a node, in voxels of the map.
    pub(super) fn first_voxel(self, key: NodeKey) -> [i64; 3] {
        match self.tile_level.checked_sub(key.level) {
            Some(finer) => key.index.map(|k| {
                let block = i64::from(k & ((1 << finer) - 1));
                i64::from(k >> finer) * self.tile_edge + ((block * MAX_EDGE) << key.level)
            }),
            None => key.index.map(|k| (i64::from(k) * self.tile_edge) << (key.level - self.tile_level)),
        }
    }

    /// Returns the number of the node's voxels along each axis; 0 or less for blocks outside the tile.
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

/// Converts a number of voxels to voxels `2^level` times as wide, rounded up.
fn ceil_shift(voxels: i64, level: u8) -> i64 {
    (voxels + (1 << level) - 1) >> level
}
