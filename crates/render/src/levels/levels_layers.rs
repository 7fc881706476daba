//! Layers of the nodes of a map. Coarse nodes are stored with the sums of their layers, those of tiles on request.

use super::cells::{Cells, Kind};
use super::layer_planes;
use super::layer_sums::LayerSums;
use super::layer_totals::LayerTotals;
use super::levels_of_map::{Levels, Node};
use super::node_bytes;
use super::node_key::NodeKey;
use super::node_store::NodeStore;
use crate::Layer;
use voxtile::Result;
use voxtile::mapper::MapView;
use voxtile::space::TileIndex;

/// Combined with the version of a node, gives that of its layers. Change it when sums are computed or encoded
/// differently.
const LAYERS_FORMAT: u64 = 0x6c61_7965_7273_0001;

/// Position of a voxel in its node, as in [`Levels::voxels`], and its mean colour.
pub type ColouredVoxel = ([u8; 3], Option<[u8; 3]>);

impl Levels {
    pub(super) fn has_layers(&self) -> bool {
        let layers = self.config.layers();
        Layer::ALL.iter().any(|layer| layer.is_in(&layers))
    }

    /// Returns whether the store has the layers of a node, or the map has none.
    pub(super) fn has_stored_layers(&self, store: &NodeStore, key: NodeKey, node: Node) -> bool {
        !self.has_layers() || store.find(key, node.version ^ LAYERS_FORMAT).is_some()
    }

    /// Returns the stored layers of a node; `None` if they are missing or damaged.
    pub(super) fn stored_layers(
        &self,
        store: &NodeStore,
        key: NodeKey,
        node: Node,
    ) -> Result<Option<LayerSums>> {
        let bytes = store.get(key, node.version ^ LAYERS_FORMAT)?;
        Ok(bytes.and_then(|bytes| LayerSums::decode(&bytes).ok()))
    }

    pub(super) fn store_layers(
        &self,
        store: &NodeStore,
        key: NodeKey,
        node: Node,
        layers: &LayerSums,
    ) -> Result<()> {
        let (version, voxels) = (node.version ^ LAYERS_FORMAT, layers.voxels.len() as u32);
        store.put(key, version, &layers.encode(), [[0; 3]; 2], voxels).map(|_| ())
    }

    /// Returns the bytes of a node of occupied voxels as [`Levels::node`] does, with the values of a layer.
    ///
    /// # Errors
    ///
    /// [`InvalidArgument`](voxtile::Error::InvalidArgument) if the map has no such layer. Fails if a tile or the store
    /// cannot be read.
    pub fn layered_node<V: MapView>(
        &self,
        map: &V,
        store: &NodeStore,
        key: NodeKey,
        layer: Layer,
    ) -> Result<Option<Vec<u8>>> {
        layer.check(&self.config.layers())?;
        let Some(bytes) = self.node(map, store, key, Kind::Occupied)? else { return Ok(None) };
        let cells = node_bytes::decode(&bytes).or_else(|_| self.cells(map, store, key))?;
        let sums = self.layers_of_cells(map, store, key, &cells)?;
        let values = layer_planes::encode(layer, &cells, &sums, &self.config.layers());
        let head = self.head(key, Kind::Occupied);
        Ok(Some(node_bytes::encode_layered(&head, &cells, layer_planes::number_of(layer), &values)))
    }

    /// Returns the voxels of a node as [`Levels::voxels`] does, with their mean colours; `None` for voxels without one.
    ///
    /// # Errors
    ///
    /// [`InvalidArgument`](voxtile::Error::InvalidArgument) if the map has no colours. Fails if a tile or the store
    /// cannot be read.
    pub fn coloured_voxels<V: MapView>(
        &self,
        map: &V,
        store: &NodeStore,
        key: NodeKey,
    ) -> Result<Vec<ColouredVoxel>> {
        Layer::Colour.check(&self.config.layers())?;
        let cells = self.cells(map, store, key)?;
        let sums = self.layers_of_cells(map, store, key, &cells)?;
        Ok(cells.positions().zip(layer_planes::colours(&cells, &sums)).collect())
    }

    /// Returns the layers of the occupied voxels of a node.
    fn layers_of_cells<V: MapView>(
        &self,
        map: &V,
        store: &NodeStore,
        key: NodeKey,
        cells: &Cells,
    ) -> Result<LayerSums> {
        match self.scheme.tile_of(key) {
            _ if cells.cells.is_empty() => Ok(LayerSums::default()),
            Some(tile) => self.layers_of_tile_node(map, store, key, tile),
            None => Ok(self.content(map, store, key, true)?.1),
        }
    }

    /// Returns the layers of a tile or of a part of one. Stores those of all nodes of the tile, because a viewer that
    /// loads one of them usually loads the others.
    fn layers_of_tile_node<V: MapView>(
        &self,
        map: &V,
        store: &NodeStore,
        key: NodeKey,
        tile: TileIndex,
    ) -> Result<LayerSums> {
        let Some(&node) = self.nodes.get(&self.scheme.key_of_tile(tile)) else {
            return Ok(LayerSums::default());
        };
        let store = Self::store_of_tile(map, store, tile);
        if let Some(sums) = store.map(|store| self.stored_layers(store, key, node)).transpose()?.flatten() {
            return Ok(sums);
        }
        let Some(read) = map.tile_uncached(tile)? else { return Ok(LayerSums::default()) };
        let mut sums = LayerSums::of_nodes_of_tile(self.scheme, &read, &self.config);
        for (key, sums) in &sums {
            // Layers can be computed again, so continue if the disk is full.
            if let Some(Err(error)) = store.map(|store| self.store_layers(store, *key, node, sums)) {
                log::debug!("{error:#}");
            }
        }
        Ok(sums.remove(&key).unwrap_or_default())
    }

    /// Returns the layers of all occupied voxels.
    ///
    /// # Errors
    ///
    /// Fails if a tile or the store cannot be read.
    pub fn layer_totals<V: MapView>(&self, map: &V, store: &NodeStore) -> Result<LayerTotals> {
        let mut totals = LayerTotals::default();
        if self.has_layers() {
            for &top in self.tops() {
                totals.add(&self.content(map, store, top, true)?.1.totals);
            }
        }
        Ok(totals)
    }
}
