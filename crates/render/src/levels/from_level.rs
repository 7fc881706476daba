use super::node_key::NodeKey;
use super::node_store::NodeStore;
use super::tileset::TilesetNodes;
use std::collections::BTreeSet;
use voxtile::Result;
use voxtile::space::{Aabb, Point};

/// Nodes with occupied voxels, from a level on: a tileset without the finer ones.
pub struct FromLevel<'a> {
    nodes: &'a dyn TilesetNodes,
    finest: u8,
}

impl<'a> FromLevel<'a> {
    /// Leaves out the nodes below level `finest`, but not the coarsest nodes.
    pub fn new(nodes: &'a dyn TilesetNodes, finest: u8) -> Self {
        let top = nodes.tops().first().map_or(0, |top| top.level);
        Self { nodes, finest: finest.min(top) }
    }

    /// Returns the level of the finest nodes.
    pub fn finest(&self) -> u8 {
        self.finest
    }
}

impl std::fmt::Debug for FromLevel<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("FromLevel").field("finest", &self.finest).finish_non_exhaustive()
    }
}

impl TilesetNodes for FromLevel<'_> {
    fn tops(&self) -> Vec<NodeKey> {
        self.nodes.tops()
    }

    fn version(&self, key: NodeKey) -> Option<u64> {
        self.nodes.version(key).filter(|_| key.level >= self.finest && self.nodes.is_occupied(key))
    }

    fn is_occupied(&self, key: NodeKey) -> bool {
        key.level >= self.finest && self.nodes.is_occupied(key)
    }

    fn bounds_m(&self, store: &NodeStore, key: NodeKey) -> Aabb {
        self.nodes.bounds_m(store, key)
    }

    fn corner_m(&self, key: NodeKey) -> Point {
        self.nodes.corner_m(key)
    }

    fn voxel_edge_m(&self, level: u8) -> f64 {
        self.nodes.voxel_edge_m(level)
    }

    /// Nodes of the finest level have no children, as tiles.
    fn tile_level(&self) -> u8 {
        self.nodes.tile_level().max(self.finest)
    }

    fn is_divided(&self, key: NodeKey) -> bool {
        self.nodes.is_divided(key) && key.level > self.finest
    }

    fn within_tile(&self, store: &NodeStore, key: NodeKey) -> Result<BTreeSet<NodeKey>> {
        let mut within = self.nodes.within_tile(store, key)?;
        within.retain(|key| key.level >= self.finest);
        Ok(within)
    }
}
