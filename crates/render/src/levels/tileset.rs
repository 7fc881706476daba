//! Writes nodes as [3D Tiles 1.1](https://docs.ogc.org/cs/22-025r4/22-025r4.html): trees of boxes, divided into files
//! of three levels.

use super::levels_of_map::Levels;
use super::node_key::NodeKey;
use super::node_store::NodeStore;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use voxtile::Result;
use voxtile::mapper::MapView;
use voxtile::space::{Aabb, Point};

/// Format of a tileset's nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TilesetContent {
    /// Bytes of [`Levels::node`], `.vox`.
    Voxels,
    /// Meshes, `.glb`, with coordinates relative to the node's corner, so that `f32` is precise anywhere.
    Meshes,
}

/// Source of the nodes of a tileset.
pub trait TilesetNodes {
    /// Returns the coarsest nodes.
    fn tops(&self) -> Vec<NodeKey>;

    /// Returns a number that changes with the node's content; `None` if there is no such node.
    fn version(&self, key: NodeKey) -> Option<u64>;

    /// Returns whether a node has occupied voxels. Some tiles have only free voxels, which a viewer may request.
    fn is_occupied(&self, key: NodeKey) -> bool;

    /// Returns the version of a node, or of the tile that contains it.
    fn version_of(&self, key: NodeKey) -> Option<u64> {
        let level = key.level.max(self.tile_level());
        self.version(NodeKey { level, index: key.index.map(|k| k >> (level - key.level)) })
    }

    /// Returns a box around the node's voxels in metres.
    fn bounds_m(&self, store: &NodeStore, key: NodeKey) -> Aabb;

    /// Returns the lower corner of a node in metres.
    fn corner_m(&self, key: NodeKey) -> Point;

    /// Returns the edge length of the voxels of a level in metres.
    fn voxel_edge_m(&self, level: u8) -> f64;

    /// Returns the level of nodes that are tiles.
    fn tile_level(&self) -> u8;

    /// Returns whether a node is a tile that is divided into nodes, which are in a file of their own.
    fn is_divided(&self, key: NodeKey) -> bool {
        key.level == self.tile_level() && key.level > 0
    }

    /// Returns the nodes inside a tile that is divided.
    ///
    /// # Errors
    ///
    /// Fails if a tile cannot be read.
    fn within_tile(&self, store: &NodeStore, key: NodeKey) -> Result<BTreeSet<NodeKey>>;
}

/// Number of levels per file.
const FILE_LEVELS: u8 = 3;

/// Returns the tileset of all nodes, for `tileset.json`. Files of further levels are at `subtree/L/X/Y/Z.json`, nodes
/// at `node/L/X/Y/Z.vox` or `.glb`.
///
/// # Errors
///
/// Fails if a tile cannot be read.
pub fn tileset(
    nodes: &dyn TilesetNodes,
    store: &NodeStore,
    content: TilesetContent,
    extras: Value,
) -> Result<Value> {
    let tops = nodes.tops();
    let boxes: Vec<Aabb> = tops.iter().map(|&key| nodes.bounds_m(store, key)).collect();
    let around =
        boxes.into_iter().reduce(|a, b| union(&a, &b)).unwrap_or(Aabb { min: [0.0; 3], max: [0.0; 3] });
    let writer = Writer { nodes, store, content, to_root: "" };
    let top_level = tops.first().map_or(0, |key| key.level);
    let children =
        tops.iter().map(|&key| writer.node(key, [0.0; 3], FILE_LEVELS, None)).collect::<Result<Vec<_>>>()?;
    // Larger than any child's error, so that the empty root is always refined.
    let error_m = 4.0 * nodes.voxel_edge_m(top_level) + length(&around);
    let mut root = json!({
        "boundingVolume": { "box": box_of(&around) },
        "geometricError": error_m,
        "refine": "REPLACE",
    });
    if !children.is_empty() {
        root["children"] = children.into();
    }
    Ok(json!({
        "asset": { "version": "1.1", "generator": concat!("voxtile ", env!("CARGO_PKG_VERSION")), "extras": extras },
        "geometricError": error_m,
        "root": root,
    }))
}

/// Returns the file `subtree/L/X/Y/Z.json` of a node; `None` if there is no such node.
///
/// # Errors
///
/// Fails if a tile cannot be read.
pub fn subtree(
    nodes: &dyn TilesetNodes,
    store: &NodeStore,
    content: TilesetContent,
    key: NodeKey,
) -> Result<Option<Value>> {
    let level = key.level.max(nodes.tile_level());
    if nodes.version(NodeKey { level, ..key }).is_none() || key.level != level {
        return Ok(None);
    }
    let within = if key.level == nodes.tile_level() { Some(nodes.within_tile(store, key)?) } else { None };
    let writer = Writer { nodes, store, content, to_root: "../../../../" };
    Ok(Some(json!({
        "asset": { "version": "1.1" },
        "geometricError": nodes.voxel_edge_m(key.level),
        "root": writer.node(key, nodes.corner_m(key), FILE_LEVELS, within.as_ref())?,
    })))
}

/// Passes all files below a tileset file to `write`, each with its node.
///
/// # Errors
///
/// Fails if a tile cannot be read, or with the error of `write`.
pub fn for_each_subtree(
    nodes: &dyn TilesetNodes,
    store: &NodeStore,
    content: TilesetContent,
    file: &Value,
    write: &mut dyn FnMut(NodeKey, &Value) -> Result<()>,
) -> Result<()> {
    let mut open = vec![file["root"].clone()];
    while let Some(node) = open.pop() {
        open.extend(node["children"].as_array().into_iter().flatten().cloned());
        let path =
            node["content"]["uri"].as_str().and_then(|uri| uri.trim_start_matches("../").split('?').next());
        let key = path.and_then(|path| path.strip_prefix("subtree/")?.strip_suffix(".json")?.parse().ok());
        if let Some(key) = key
            && let Some(file) = subtree(nodes, store, content, key)?
        {
            write(key, &file)?;
            open.push(file["root"].clone());
        }
    }
    Ok(())
}

struct Writer<'a> {
    nodes: &'a dyn TilesetNodes,
    store: &'a NodeStore,
    content: TilesetContent,
    /// Relative path from the file to the folder of `tileset.json`.
    to_root: &'static str,
}

impl Writer<'_> {
    /// Returns whether a node exists; a mesh without voxels does not.
    fn is_written(&self, key: NodeKey) -> bool {
        match self.content {
            TilesetContent::Voxels => self.nodes.version(key).is_some(),
            TilesetContent::Meshes => self.nodes.is_occupied(key),
        }
    }

    /// Returns a node with its descendants in the same file. `within` contains the nodes inside a tile. `corner_m` is
    /// the corner of the parent, to which coordinates of meshes are relative.
    fn node(
        &self,
        key: NodeKey,
        corner_m: Point,
        levels: u8,
        within: Option<&BTreeSet<NodeKey>>,
    ) -> Result<Value> {
        let version = match within {
            // Parts of a tile have the tile's version.
            Some(_) => self.nodes.version_of(key),
            None => self.nodes.version(key),
        }
        .unwrap_or_default();
        // Meshes are files, and file names contain no question mark.
        let version = match self.content {
            TilesetContent::Voxels => format!("?v={version:016x}"),
            TilesetContent::Meshes => String::new(),
        };
        let bounds = self.nodes.bounds_m(self.store, key);
        let children: Vec<NodeKey> = match within {
            Some(within) => key.children().filter(|child| within.contains(child)).collect(),
            None if key.level == self.nodes.tile_level() => Vec::new(),
            None => key.children().filter(|&child| self.is_written(child)).collect(),
        };
        let is_divided_tile = within.is_none() && self.nodes.is_divided(key);
        let error_m =
            if children.is_empty() && !is_divided_tile { 0.0 } else { self.nodes.voxel_edge_m(key.level) };
        let own_m = self.nodes.corner_m(key);
        let mut node = match self.content {
            TilesetContent::Voxels => json!({ "boundingVolume": { "box": box_of(&bounds) } }),
            TilesetContent::Meshes => {
                let mut node = json!({ "boundingVolume": { "box": box_of(&relative(&bounds, own_m)) } });
                let [x, y, z] = [0, 1, 2].map(|k| own_m[k] - corner_m[k]);
                if [x, y, z] != [0.0; 3] {
                    node["transform"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1]);
                }
                node
            }
        };
        node["geometricError"] = error_m.into();
        if is_divided_tile || (levels == 0 && within.is_none() && !children.is_empty()) {
            node["content"] = json!({ "uri": format!("{}subtree/{key}.json{version}", self.to_root) });
            return Ok(node);
        }
        let extension = match self.content {
            TilesetContent::Voxels => "vox",
            TilesetContent::Meshes => "glb",
        };
        node["content"] = json!({ "uri": format!("{}node/{key}.{extension}{version}", self.to_root) });
        if !children.is_empty() {
            let children =
                children.into_iter().map(|child| self.node(child, own_m, levels.saturating_sub(1), within));
            node["children"] = children.collect::<Result<Vec<_>>>()?.into();
        }
        Ok(node)
    }
}

/// Levels of a map, with the map for reading tiles.
#[derive(Debug)]
pub struct LevelsOf<'a, V> {
    /// Levels of the map.
    pub levels: &'a Levels,
    /// Map of the levels.
    pub map: &'a V,
}

impl<V: MapView> TilesetNodes for LevelsOf<'_, V> {
    fn tops(&self) -> Vec<NodeKey> {
        self.levels.tops().to_vec()
    }

    fn version(&self, key: NodeKey) -> Option<u64> {
        self.levels.get(key).map(|node| node.version)
    }

    fn is_occupied(&self, key: NodeKey) -> bool {
        self.levels.get(key).is_some_and(|node| node.is_occupied)
    }

    fn bounds_m(&self, store: &NodeStore, key: NodeKey) -> Aabb {
        self.levels.bounds_m(store, key)
    }

    fn corner_m(&self, key: NodeKey) -> Point {
        self.levels.corner_m(key)
    }

    fn voxel_edge_m(&self, level: u8) -> f64 {
        self.levels.voxel_edge_m(level)
    }

    fn tile_level(&self) -> u8 {
        self.levels.scheme.tile_level()
    }

    fn within_tile(&self, store: &NodeStore, key: NodeKey) -> Result<BTreeSet<NodeKey>> {
        self.levels.blocks_of_tile(self.map, store, key.index.into())
    }
}

fn union(a: &Aabb, b: &Aabb) -> Aabb {
    Aabb {
        min: std::array::from_fn(|k| a.min[k].min(b.min[k])),
        max: std::array::from_fn(|k| a.max[k].max(b.max[k])),
    }
}

fn relative(around: &Aabb, origin: Point) -> Aabb {
    let less = |corner: Point| [0, 1, 2].map(|k| corner[k] - origin[k]);
    Aabb { min: less(around.min), max: less(around.max) }
}

fn length(around: &Aabb) -> f64 {
    (0..3).map(|k| (around.max[k] - around.min[k]).powi(2)).sum::<f64>().sqrt()
}

/// Returns the center and half of each edge as vectors.
fn box_of(around: &Aabb) -> [f64; 12] {
    let center = |k: usize| 0.5 * (around.min[k] + around.max[k]);
    let half = |k: usize| 0.5 * (around.max[k] - around.min[k]);
    [center(0), center(1), center(2), half(0), 0.0, 0.0, 0.0, half(1), 0.0, 0.0, 0.0, half(2)]
}
