use super::cells::{Cells, Kind, Scale};
use super::layer_sums::{CollectedSums, LayerSums};
use super::node_bytes::{self, Head};
use super::node_key::{MAX_LEVEL, NodeKey};
use super::node_store::{NodeStore, Stored};
use super::scheme::Scheme;
use parking_lot::Mutex;
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::collections::{BTreeMap, BTreeSet};
use voxtile::MapConfig;
use voxtile::mapper::MapView;
use voxtile::space::{Aabb, Point, TileBox, TileIndex};
use voxtile::{Error, Result};

/// Levels of detail of one state of a map, or of some of its tiles.
///
/// ```
/// use voxtile_render::levels::{Kind, Levels, NodeStore};
/// use voxtile::{InMemoryMapper, MapConfig, MapView, Mapper, Scan};
///
/// # fn main() -> voxtile::Result<()> {
/// let mut map = InMemoryMapper::new(MapConfig::new(0.1, 10.0)?)?;
/// map.insert_scan(&Scan { points: vec![[5.0, 0.0, 0.0]], ..Scan::default() })?;
/// let store = NodeStore::open(std::io::Cursor::new(Vec::new()), "nodes")?;
/// let levels = Levels::build(&map, &map.tile_indices(), 0, &store, &|_| true)?.expect("not stopped");
/// let top = levels.tops()[0];
/// assert!(levels.node(&map, &store, top, Kind::Occupied)?.is_some());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Levels {
    pub(super) config: MapConfig,
    pub(super) scheme: Scheme,
    /// Nodes at the level of tiles and coarser. Nodes without occupied voxels are included only if a sibling has some.
    pub(super) nodes: FxHashMap<NodeKey, Node>,
    tops: Vec<NodeKey>,
    /// Bounds of all tiles.
    tile_box: Option<TileBox>,
    unreadable: Vec<String>,
}

/// Properties of a node that are known without its bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Node {
    /// Hash of the tiles below the node, the threshold and [`NODE_FORMAT`].
    pub(super) version: u64,
    /// Whether the node has occupied voxels.
    pub(super) is_occupied: bool,
    /// Last scan that may have changed the node; 0 if unknown.
    last_scan: u64,
}

/// Increment when nodes are computed differently.
const NODE_FORMAT: u64 = 1;
/// Maximum number of voxels in the coarsest level, so that it loads at once.
const MAX_TOP_VOXELS: u64 = 4096;

impl Levels {
    /// Builds those coarse nodes of the given tiles that the store lacks, on all cores. `progress` receives the number
    /// of tiles read since its last call; if it returns `false`, the build stops and returns `None`. Nodes built until
    /// then remain in the store.
    ///
    /// Damaged tiles are skipped and listed by [`Levels::unreadable`].
    ///
    /// Nodes are identified by the versions of their tiles. Tiles of OctoMap files and of maps without a log have no
    /// versions. For these, pass a different `origin` for each map and for each state of a map.
    ///
    /// Memory: about sixty bytes per tile, and a few tiles per thread.
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read for other reasons than damage, or if the store cannot be read or written.
    pub fn build<V: MapView>(
        map: &V,
        tiles: &[TileIndex],
        origin: u64,
        store: &NodeStore,
        progress: &(dyn Fn(u64) -> bool + Sync),
    ) -> Result<Option<Self>> {
        let mut left_out = BTreeSet::new();
        let mut unreadable = Vec::new();
        loop {
            let damaged = Mutex::new(Vec::new());
            let levels = Self::build_without(map, tiles, origin, &left_out, store, progress, &damaged)?;
            let damaged = damaged.into_inner();
            if damaged.is_empty() {
                return Ok(levels.map(|levels| Self { unreadable, ..levels }));
            }
            for (tile, reason) in damaged {
                if left_out.insert(tile) {
                    unreadable.push(reason);
                }
            }
        }
    }

    fn build_without<V: MapView>(
        map: &V,
        tiles: &[TileIndex],
        origin: u64,
        left_out: &BTreeSet<TileIndex>,
        store: &NodeStore,
        progress: &(dyn Fn(u64) -> bool + Sync),
        damaged: &Mutex<Vec<(TileIndex, String)>>,
    ) -> Result<Option<Self>> {
        let config = map.config().clone();
        let scheme = Scheme::of(&config.grid);
        let mut levels = Self {
            config,
            scheme,
            nodes: FxHashMap::default(),
            tops: Vec::new(),
            tile_box: TileBox::of(tiles.iter().copied()),
            unreadable: Vec::new(),
        };
        let mut level: Vec<(NodeKey, Node)> = tiles
            .iter()
            .filter(|tile| !left_out.contains(tile))
            .map(|&tile| (scheme.key_of_tile(tile), levels.node_of_tile(map, tile, origin)))
            .collect();
        level.sort_unstable_by_key(|(key, _)| *key);
        levels.nodes.extend(level.iter().copied());
        loop {
            level.retain(|(_, node)| node.is_occupied);
            let parents = parents_of(&level);
            let made = parents.par_iter().map(|&(key, node)| {
                let stored = match store
                    .find(key, node.version)
                    .filter(|_| levels.has_stored_layers(store, key, node))
                {
                    Some(stored) => stored,
                    None => match levels.make(map, store, key, node, damaged)? {
                        Some(stored) => stored,
                        None => return Ok(None),
                    },
                };
                let tiles = if key.level == scheme.tile_level() + 1 { 8 } else { 0 };
                if !progress(tiles) {
                    return Err(Stop::Asked);
                }
                Ok(Some((key, Node { is_occupied: stored.voxels > 0, ..node }, stored.voxels)))
            });
            let made: Vec<_> = match made.collect::<std::result::Result<_, Stop>>() {
                Ok(made) => made,
                Err(Stop::Asked) => return Ok(None),
                Err(Stop::Failed(error)) => return Err(error),
            };
            if !damaged.lock().is_empty() || parents.is_empty() {
                return Ok(Some(levels));
            }
            let voxels: u64 = made.iter().flatten().map(|(_, _, voxels)| u64::from(*voxels)).sum();
            level = made.into_iter().flatten().map(|(key, node, _)| (key, node)).collect();
            levels.nodes.extend(level.iter().copied());
            let is_coarsest = level.first().is_none_or(|(key, _)| key.level == MAX_LEVEL);
            if is_coarsest || (voxels <= MAX_TOP_VOXELS && is_small(&level)) {
                levels.tops =
                    level.iter().filter(|(_, node)| node.is_occupied).map(|(key, _)| *key).collect();
                levels.remove_empty_regions();
                return Ok(Some(levels));
            }
        }
    }

    /// Returns the node of a tile from the map's index.
    fn node_of_tile<V: MapView>(&self, map: &V, tile: TileIndex, origin: u64) -> Node {
        let version = map.version_of_tile(tile);
        let mut hasher = blake3::Hasher::new();
        hasher.update(&NODE_FORMAT.to_le_bytes());
        hasher.update(&self.config.occupied_log_odds().to_le_bytes());
        hasher.update(tile.to_array().map(i32::to_le_bytes).as_flattened());
        match version {
            Some(version) => {
                hasher.update(&version.table.bytes.to_le_bytes());
                hasher.update(&version.table.crc.to_le_bytes());
            }
            None => {
                hasher.update(&origin.to_le_bytes());
            }
        }
        Node {
            version: first_eight(&hasher),
            is_occupied: version.is_none_or(|version| version.occupied > 0),
            last_scan: version.map_or(0, |version| version.scan_number),
        }
    }

    /// Removes nodes if neither they nor their siblings have occupied voxels; no viewer requests them.
    fn remove_empty_regions(&mut self) {
        let parents: FxHashMap<NodeKey, bool> =
            self.nodes.iter().map(|(&key, node)| (key, node.is_occupied)).collect();
        self.nodes.retain(|key, node| {
            node.is_occupied || parents.get(&key.parent()).is_some_and(|&is_occupied| is_occupied)
        });
    }

    /// Builds and stores a node of several tiles; `None` if a tile below it is damaged.
    fn make<V: MapView>(
        &self,
        map: &V,
        store: &NodeStore,
        key: NodeKey,
        node: Node,
        damaged: &Mutex<Vec<(TileIndex, String)>>,
    ) -> std::result::Result<Option<Stored>, Stop> {
        let (cells, layers) = match self.pooled(map, store, key, self.has_layers()) {
            Ok((cells, layers)) => (Cells { last_scan: node.last_scan, ..cells }, layers),
            Err(error @ Error::Damaged { tile: Some(tile), .. }) => {
                damaged.lock().push((tile, format!("{error:#}")));
                return Ok(None);
            }
            Err(error) => return Err(Stop::Failed(error)),
        };
        let bytes = node_bytes::encode(&self.head(key, Kind::Occupied), &cells);
        if self.has_layers() {
            self.store_layers(store, key, node, &layers).map_err(Stop::Failed)?;
        }
        let bounds = cells.bounds().unwrap_or_default();
        let stored = store.put(key, node.version, &bytes, bounds, cells.cells.len() as u32);
        stored.map(Some).map_err(Stop::Failed)
    }

    /// Computes the occupied voxels of a node from its children, and their layers if they are wanted.
    fn pooled<V: MapView>(
        &self,
        map: &V,
        store: &NodeStore,
        key: NodeKey,
        wants_layers: bool,
    ) -> Result<(Cells, LayerSums)> {
        let (mut cells, mut layers) = (Cells::default(), CollectedSums::default());
        for child in key.children() {
            if self.get(child).is_some_and(|node| node.is_occupied) {
                let (of_child, layers_of_child) = self.content(map, store, child, wants_layers)?;
                cells.add_child(self.scheme, key, child, &of_child);
                layers.add_child(self.scheme, key, child, &layers_of_child);
            }
        }
        Ok((cells, layers.finish()))
    }

    /// Returns the occupied voxels of a node.
    pub(super) fn cells<V: MapView>(&self, map: &V, store: &NodeStore, key: NodeKey) -> Result<Cells> {
        Ok(self.content(map, store, key, false)?.0)
    }

    /// Returns the occupied voxels of a node, and their layers if they are wanted.
    pub(super) fn content<V: MapView>(
        &self,
        map: &V,
        store: &NodeStore,
        key: NodeKey,
        wants_layers: bool,
    ) -> Result<(Cells, LayerSums)> {
        let tile = self.scheme.tile_of(key);
        let Some(node) = self.get(tile.map_or(key, |tile| self.scheme.key_of_tile(tile))) else {
            return Ok(Default::default());
        };
        let store_of_key = tile.map_or(Some(store), |tile| Self::store_of_tile(map, store, tile));
        let kept = store_of_key.map(|store| store.get(key, node.version)).transpose()?.flatten();
        let kept_layers = match store_of_key {
            Some(store) if wants_layers => self.stored_layers(store, key, node)?,
            _ if wants_layers => None,
            _ => Some(LayerSums::default()),
        };
        match (kept.map(|bytes| node_bytes::decode(&bytes)), kept_layers, tile) {
            (Some(Ok(cells)), Some(layers), _) => Ok((cells, layers)),
            (_, _, Some(tile)) => {
                let Some(tile) = map.tile_uncached(tile)? else { return Ok(Default::default()) };
                let cells =
                    Cells::of_tile(self.scheme, key, &tile, &self.config, Kind::Occupied, node.last_scan);
                let layers = wants_layers.then(|| LayerSums::of_tile(self.scheme, key, &tile, &self.config));
                Ok((cells, layers.unwrap_or_default()))
            }
            // The store lacks the node, or the stored bytes are damaged: build it again.
            _ => {
                let (cells, layers) = self.pooled(map, store, key, wants_layers)?;
                Ok((Cells { last_scan: node.last_scan, ..cells }, layers))
            }
        }
    }

    fn cells_of_tile<V: MapView>(&self, map: &V, key: NodeKey, tile: TileIndex, kind: Kind) -> Result<Cells> {
        let last_scan = self.nodes.get(&self.scheme.key_of_tile(tile)).map_or(0, |node| node.last_scan);
        let Some(tile) = map.tile_uncached(tile)? else { return Ok(Cells::default()) };
        Ok(Cells::of_tile(self.scheme, key, &tile, &self.config, kind, last_scan))
    }

    /// Returns the store for nodes of a tile, or `None` for tiles without versions, such as those of OctoMap files.
    pub(super) fn store_of_tile<'s, V: MapView>(
        map: &V,
        store: &'s NodeStore,
        tile: TileIndex,
    ) -> Option<&'s NodeStore> {
        map.version_of_tile(tile).map(|_| store)
    }

    /// Builds and stores all nodes of a tile, because a viewer that loads one of them usually loads the others. Returns
    /// the bytes and the number of voxels of each.
    fn make_nodes_of_tile<V: MapView>(
        &self,
        map: &V,
        store: &NodeStore,
        tile: TileIndex,
    ) -> Result<BTreeMap<NodeKey, (Vec<u8>, usize)>> {
        let Some(node) = self.nodes.get(&self.scheme.key_of_tile(tile)) else { return Ok(BTreeMap::new()) };
        let Some(read) = map.tile_uncached(tile)? else { return Ok(BTreeMap::new()) };
        let made = Cells::of_nodes_of_tile(self.scheme, &read, &self.config, node.last_scan).into_iter();
        let store = Self::store_of_tile(map, store, tile);
        let made = made.map(|(key, cells)| {
            let bytes = node_bytes::encode(&self.head(key, Kind::Occupied), &cells);
            let (bounds, voxels) = (cells.bounds().unwrap_or_default(), cells.cells.len());
            // Nodes can be rebuilt, so continue if the disk is full.
            let put = store.map(|store| store.put(key, node.version, &bytes, bounds, voxels as u32));
            if let Some(Err(error)) = put {
                log::debug!("{error:#}");
            }
            (key, (bytes, voxels))
        });
        Ok(made.collect())
    }

    /// Returns the gzip-compressed bytes of a node (`docs/view.md`); `None` if there is no such node. Only nodes that
    /// are tiles or parts of tiles have free and unknown voxels.
    ///
    /// # Errors
    ///
    /// Fails if a tile or the store cannot be read.
    pub fn node<V: MapView>(
        &self,
        map: &V,
        store: &NodeStore,
        key: NodeKey,
        kind: Kind,
    ) -> Result<Option<Vec<u8>>> {
        let head = self.head(key, kind);
        let Some(tile) = self.scheme.tile_of(key) else {
            let Some(node) = self.nodes.get(&key).filter(|_| kind == Kind::Occupied) else { return Ok(None) };
            return match store.get(key, node.version)? {
                Some(bytes) => Ok(Some(bytes)),
                None => Ok(Some(node_bytes::encode(&head, &self.cells(map, store, key)?))),
            };
        };
        let is_there = self.scheme.edges(key).iter().all(|&edge| edge > 0);
        let Some(node) = self.nodes.get(&self.scheme.key_of_tile(tile)).filter(|_| is_there) else {
            return Ok(None);
        };
        let cells = match kind {
            Kind::Occupied if !node.is_occupied => Cells { last_scan: node.last_scan, ..Cells::default() },
            Kind::Occupied => {
                let kept = Self::store_of_tile(map, store, tile).map(|store| store.get(key, node.version));
                if let Some(bytes) = kept.transpose()?.flatten() {
                    return Ok(Some(bytes));
                }
                return Ok(self.make_nodes_of_tile(map, store, tile)?.remove(&key).map(|(bytes, _)| bytes));
            }
            _ => self.cells_of_tile(map, key, tile, kind)?,
        };
        Ok(Some(node_bytes::encode(&head, &cells)))
    }

    /// Returns the positions of the occupied voxels of a node, relative to its lower corner, in units of
    /// [`Levels::voxel_edge_m`].
    ///
    /// # Errors
    ///
    /// Fails if a tile or the store cannot be read.
    pub fn voxels<V: MapView>(&self, map: &V, store: &NodeStore, key: NodeKey) -> Result<Vec<[u8; 3]>> {
        Ok(self.cells(map, store, key)?.positions().collect())
    }

    /// Returns whether a node is a tile.
    pub fn is_tile(&self, key: NodeKey) -> bool {
        key.level == self.scheme.tile_level()
    }

    /// Returns the lower corner of a node in metres.
    pub fn corner_m(&self, key: NodeKey) -> Point {
        self.head(key, Kind::Occupied).corner_m
    }

    /// Returns the nodes with occupied voxels in order, except those inside tiles.
    pub fn keys(&self) -> Vec<NodeKey> {
        let occupied = self.nodes.iter().filter(|(_, node)| node.is_occupied);
        let mut keys: Vec<_> = occupied.map(|(key, _)| *key).collect();
        keys.sort_unstable();
        keys
    }

    /// If a tile is divided, returns the tile and the nodes inside it; otherwise no nodes.
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read.
    pub fn keys_within<V: MapView>(&self, map: &V, store: &NodeStore, tile: NodeKey) -> Result<Vec<NodeKey>> {
        match self.scheme.tile_of(tile).filter(|_| tile.level == self.scheme.tile_level() && tile.level > 0) {
            Some(index) => Ok(self.blocks_of_tile(map, store, index)?.into_iter().collect()),
            None => Ok(Vec::new()),
        }
    }

    /// Returns the blocks of a tile, at all levels, that have occupied voxels.
    pub(super) fn blocks_of_tile<V: MapView>(
        &self,
        map: &V,
        store: &NodeStore,
        tile: TileIndex,
    ) -> Result<BTreeSet<NodeKey>> {
        let own = self.scheme.key_of_tile(tile);
        let Some(node) = self.nodes.get(&own) else { return Ok(BTreeSet::new()) };
        let keys = self.scheme.nodes_of_tile(tile).into_iter();
        let kept = Self::store_of_tile(map, store, tile);
        let known: Option<Vec<_>> =
            keys.map(|key| Some((key, kept?.find(key, node.version)?.voxels as usize))).collect();
        let voxels = match known {
            Some(known) => known,
            None => {
                let made = self.make_nodes_of_tile(map, store, tile)?.into_iter();
                made.map(|(key, (_, voxels))| (key, voxels)).collect()
            }
        };
        let blocks = voxels.into_iter().filter(|&(key, voxels)| key != own && voxels > 0);
        Ok(blocks.map(|(key, _)| key).collect())
    }

    pub(super) fn head(&self, key: NodeKey, kind: Kind) -> Head {
        let resolution_m = self.config.grid.resolution_m();
        let edges = self.scheme.edges(key);
        Head {
            corner_m: self.scheme.first_voxel(key).map(|voxel| voxel as f64 * resolution_m),
            voxel_edge_m: self.voxel_edge_m(key.level),
            edge: edges.into_iter().max().unwrap_or(0).max(0),
            kind: match kind {
                Kind::Occupied => 0,
                Kind::Free => 1,
                Kind::Unknown => 2,
            },
            scale: Scale::of(&self.config, kind),
            threshold: self.config.occupied_log_odds(),
        }
    }

    /// Edge length of the voxels of a level, in metres.
    pub fn voxel_edge_m(&self, level: u8) -> f64 {
        self.config.grid.resolution_m() * (1_u64 << level) as f64
    }

    /// Returns the coarsest nodes, at most eight, which cover the map in few voxels. Empty for a map without occupied
    /// voxels.
    pub fn tops(&self) -> &[NodeKey] {
        &self.tops
    }

    /// Returns an error for each damaged tile, which the levels skip.
    pub fn unreadable(&self) -> &[String] {
        &self.unreadable
    }

    /// Returns the number of nodes that are tiles.
    pub fn tiles(&self) -> usize {
        self.nodes.keys().filter(|key| key.level == self.scheme.tile_level()).count()
    }

    /// Returns the properties of a node. For a key above the coarsest level, combines those of the coarsest nodes below
    /// it.
    pub(super) fn get(&self, key: NodeKey) -> Option<Node> {
        let top_level = self.tops.first().map_or(MAX_LEVEL, |top| top.level);
        if key.level <= top_level {
            return self.nodes.get(&key).copied();
        }
        let up = |top: &NodeKey| NodeKey {
            level: key.level,
            index: top.index.map(|k| k >> (key.level - top.level).min(31)),
        };
        let below = self.tops.iter().filter(|top| up(top) == key).filter_map(|top| self.nodes.get(top));
        below.copied().reduce(|a, b| Node {
            version: a.version.rotate_left(1) ^ b.version,
            last_scan: a.last_scan.max(b.last_scan),
            is_occupied: true,
        })
    }

    /// Returns a box around the occupied voxels of a node in metres, as tight as possible without reading a tile.
    pub fn bounds_m(&self, store: &NodeStore, key: NodeKey) -> Aabb {
        let head = self.head(key, Kind::Occupied);
        let stored = self.nodes.get(&key).and_then(|node| store.find(key, node.version));
        let bounds = match stored.filter(|stored| stored.voxels > 0) {
            Some(stored) => stored.bounds,
            None => [[0; 3], self.scheme.edges(key).map(|edge| (edge - 1).clamp(0, 255) as u8)],
        };
        let [min, max] = node_bytes::bounds_m(&head, bounds);
        // Clip the box, because coarse voxels may extend beyond the tiles.
        let Some(tiles) = self.tile_box else { return Aabb { min, max } };
        let edge_m = self.config.grid.tile_size_m();
        let (low, high) = (tiles.min().to_array(), tiles.max().to_array());
        Aabb {
            min: std::array::from_fn(|k| min[k].max(f64::from(low[k]) * edge_m)),
            max: std::array::from_fn(|k| max[k].min((f64::from(high[k]) + 1.0) * edge_m)),
        }
    }
}

enum Stop {
    Asked,
    Failed(Error),
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Failed(error)
    }
}

/// Returns the parents of a sorted level, with their versions.
fn parents_of(level: &[(NodeKey, Node)]) -> Vec<(NodeKey, Node)> {
    let mut children: Vec<_> = level.iter().map(|&(key, node)| (key.parent(), key, node)).collect();
    children.sort_unstable_by_key(|&(parent, key, _)| (parent, key));
    let families = children.chunk_by(|(first, ..), (second, ..)| first == second);
    families
        .map(|family| {
            let mut hasher = blake3::Hasher::new();
            for (_, key, node) in family {
                hasher.update(key.index.map(i32::to_le_bytes).as_flattened());
                hasher.update(&node.version.to_le_bytes());
            }
            let last_scan = family.iter().map(|(_, _, node)| node.last_scan).max().unwrap_or(0);
            (family[0].0, Node { version: first_eight(&hasher), is_occupied: true, last_scan })
        })
        .collect()
}

fn first_eight(hasher: &blake3::Hasher) -> u64 {
    let hash = hasher.finalize();
    hash.as_bytes().iter().take(8).fold(0, |number, &byte| number << 8 | u64::from(byte))
}

/// Returns whether a level has at most two nodes along each axis.
fn is_small(level: &[(NodeKey, Node)]) -> bool {
    (0..3).all(|k| {
        let places = level.iter().map(|(key, _)| i64::from(key.index[k]));
        let (least, most) =
            places.fold((i64::MAX, i64::MIN), |(least, most), at| (least.min(at), most.max(at)));
        most - least <= 1
    })
}
