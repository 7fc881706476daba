//! Writes a folder with the page and all that it shows, which any static web server can serve.
//!
//! The files have the paths of the server's interface (docs/view.md). Node files keep their compression, because static
//! servers send files as they are; values of a layer are in `node/L/X/Y/Z.LAYER.vox`.

use super::answers::{TRAJECTORY, described, extent_m, name_of, trajectory};
use super::map_state::layer_legends;
use super::moving::moving_within;
use super::overview::overview;
use super::{node_cache, page};
use anyhow::Context;
use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use voxtile::mapper::MapView;
use voxtile::space::{Aabb, TileIndex};
use voxtile::{Error, Result};
use voxtile_pipeline::output::StagedOutput;
use voxtile_pipeline::{AnyMap, Watch, read_any_map, tiles_of};
use voxtile_render::levels::{
    FromLevel, Kind, Levels, LevelsOf, NodeKey, NodeStore, TilesetContent, for_each_subtree, tileset,
};
use voxtile_render::{ColorMap, Layer};

/// Maps to write, and how much of them.
#[derive(Clone, Debug)]
pub struct PageOptions {
    /// Folders of maps, `FOLDER@SNAPSHOT`, OctoMap files, or URLs of maps; each is a layer.
    pub maps: Vec<PathBuf>,
    /// Folder to write; absent or empty.
    pub output: PathBuf,
    /// Finest level of detail; voxels of level `n` have an edge of `2^n` times the resolution.
    pub finest: u8,
    /// Tiles with their center in this box, in metres; `None` for all.
    pub region: Option<Aabb>,
}

/// Content of an exported page.
#[derive(Clone, Debug, Serialize)]
pub struct PageSummary {
    /// The folder.
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    pub output: PathBuf,
    /// Number of tiles of all maps.
    pub tiles: u64,
    /// Number of nodes of all maps.
    pub nodes: u64,
    /// Number of files.
    pub files: u64,
    /// Size of all files in bytes.
    pub bytes: u64,
    /// Errors of damaged tiles, which are left out.
    pub unreadable: Vec<String>,
}

/// Writes the folder atomically: it appears when it is complete.
///
/// # Errors
///
/// Fails if the output exists and is not an empty folder, if a map cannot be read, if the region contains no center of a
/// tile, or if a file cannot be written.
pub fn export_page(options: &PageOptions, watch: &Watch) -> anyhow::Result<PageSummary> {
    let staged = StagedOutput::folder_beside(&options.output)?;
    let folder = Folder { path: staged.path()?, files: AtomicU64::new(0), bytes: AtomicU64::new(0) };
    for file in page::files() {
        folder.write(file.name, &file.plain)?;
    }
    let (mut maps, mut finest) = (Vec::new(), 0);
    let (mut tiles, mut nodes, mut unreadable) = (0, 0, Vec::new());
    for (number, path) in options.maps.iter().enumerate() {
        let written = read_any_map(path, |map| {
            folder.remove(&format!("maps/{number}"))?;
            let own = MapFolder { folder: &folder, number, map, watch };
            Ok(own.write(path, options)?)
        });
        let written = written.with_context(|| format!("cannot export {}", path.display()))?;
        maps.push(written.description);
        finest = finest.max(written.finest);
        tiles += written.tiles;
        nodes += written.nodes;
        unreadable.extend(written.unreadable);
    }
    folder.write_json(
        "maps.json",
        json!({ "maps": maps, "color_maps": ColorMap::all(), "exported": { "finest_level": finest } }),
    )?;
    staged.finish()?;
    let (files, bytes) = (folder.files.into_inner(), folder.bytes.into_inner());
    Ok(PageSummary { output: options.output.clone(), tiles, nodes, files, bytes, unreadable })
}

/// Folder of the page.
struct Folder {
    path: PathBuf,
    files: AtomicU64,
    bytes: AtomicU64,
}

impl Folder {
    fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        let path = self.path.join(name);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(|error| Error::io(folder, "create", error))?;
        }
        fs::write(&path, bytes).map_err(|error| Error::io(&path, "write", error))?;
        self.files.fetch_add(1, Relaxed);
        self.bytes.fetch_add(bytes.len() as u64, Relaxed);
        Ok(())
    }

    fn write_json(&self, name: &str, mut value: Value) -> Result<()> {
        if let Some(object) = value.as_object_mut().filter(|object| !object.contains_key("asset")) {
            object.insert("version".into(), 1.into());
        }
        self.write(name, value.to_string().as_bytes())
    }

    /// Removes what an interrupted read of a map has left.
    fn remove(&self, name: &str) -> Result<()> {
        let path = self.path.join(name);
        if path.exists() {
            fs::remove_dir_all(&path).map_err(|error| Error::io(&path, "remove", error))?;
        }
        Ok(())
    }
}

/// Part of the folder that belongs to one map.
struct MapFolder<'a> {
    folder: &'a Folder,
    number: usize,
    map: &'a AnyMap,
    watch: &'a Watch,
}

struct WrittenMap {
    description: Value,
    finest: u8,
    tiles: u64,
    nodes: u64,
    unreadable: Vec<String>,
}

impl MapFolder<'_> {
    fn write(&self, path: &Path, options: &PageOptions) -> Result<WrittenMap> {
        let map = self.map;
        let region = options.region.map(|region| tiles_of(&region, &map.config().grid)).transpose()?;
        let mut tiles = map.tile_indices();
        tiles.retain(|tile| region.is_none_or(|region| region.contains(*tile)));
        let (store, levels) = self.levels(&tiles)?;
        let all = LevelsOf { levels: &levels, map };
        let nodes = FromLevel::new(&all, options.finest);
        let root = tileset(&nodes, &store, TilesetContent::Voxels, json!({ "generation": 1 }))?;
        self.write_json("tileset.json", root.clone())?;
        let mut write = |key, file: &Value| self.write_json(&format!("subtree/{key}.json"), file.clone());
        for_each_subtree(&nodes, &store, TilesetContent::Voxels, &root, &mut write)?;
        let count = self.write_nodes(&levels, &store, nodes.finest())?;
        self.write_json("layers.json", layer_legends(&levels, map, &store)?)?;
        let within = region.map(|region| extent_m(region, map.config().grid.tile_size_m()));
        let trajectory = trajectory(map, TRAJECTORY, within.as_ref())?;
        self.write_json("trajectory.json", trajectory.clone())?;
        self.write_json("overview.json", overview(map, &tiles, within.as_ref())?)?;
        self.write_file("moving.bin", &moving_within(map, None, within.as_ref())?)?;
        let mut description = described(self.number, &name_of(path), map, &tiles);
        let unreadable = levels.unreadable().to_vec();
        for (name, value) in [
            ("generation", json!(1)),
            ("pending_tiles", json!(0)),
            ("snapshots", json!([])),
            ("unreadable", json!(unreadable)),
        ] {
            description[name] = value;
        }
        if within.is_some() {
            description["scans"] = trajectory["scans"].clone();
        }
        let finest = nodes.finest();
        Ok(WrittenMap { description, finest, tiles: tiles.len() as u64, nodes: count, unreadable })
    }

    fn levels(&self, tiles: &[TileIndex]) -> Result<(NodeStore, Levels)> {
        // Not the user's cache: every tile is read, so that damaged ones are found.
        let store = node_cache::open(None)?;
        let bar = self.watch.over_tiles(tiles.len());
        let read = AtomicU64::new(0);
        let step = |more: u64| {
            bar.set(read.fetch_add(more, Relaxed) + more, tiles.len() as u64);
            !self.watch.stop().is_set()
        };
        let levels = Levels::build(self.map, tiles, 0, &store, &step)?.ok_or(Error::Stopped)?;
        Ok((store, levels))
    }

    /// Writes the nodes from a level on. Returns their number.
    fn write_nodes(&self, levels: &Levels, store: &NodeStore, finest: u8) -> Result<u64> {
        let layers = self.map.config().layers();
        let layers: Vec<Layer> = Layer::ALL.into_iter().filter(|layer| layer.is_in(&layers)).collect();
        let mut keys = levels.keys();
        keys.retain(|key| key.level >= finest);
        let (bar, count) = (self.watch.over_tiles(keys.len()), AtomicU64::new(0));
        keys.into_par_iter().try_for_each(|key| {
            let within =
                if key.level > finest { levels.keys_within(self.map, store, key)? } else { Vec::new() };
            for key in std::iter::once(key).chain(within).filter(|key| key.level >= finest) {
                self.watch.stop().check()?;
                self.write_node(levels, store, key, &layers)?;
                count.fetch_add(1, Relaxed);
            }
            bar.step();
            Ok::<(), Error>(())
        })?;
        Ok(count.into_inner())
    }

    fn write_node(&self, levels: &Levels, store: &NodeStore, key: NodeKey, layers: &[Layer]) -> Result<()> {
        if let Some(bytes) = levels.node(self.map, store, key, Kind::Occupied)? {
            self.write_file(&format!("node/{key}.vox"), &bytes)?;
        }
        for &layer in layers {
            if let Some(bytes) = levels.layered_node(self.map, store, key, layer)? {
                self.write_file(&format!("node/{key}.{}.vox", layer.name()), &bytes)?;
            }
        }
        Ok(())
    }

    fn write_file(&self, name: &str, bytes: &[u8]) -> Result<()> {
        self.folder.write(&format!("maps/{}/{name}", self.number), bytes)
    }

    fn write_json(&self, name: &str, value: Value) -> Result<()> {
        self.folder.write_json(&format!("maps/{}/{name}", self.number), value)
    }
}
