//! A folder of 3D Tiles: `tileset.json`, and the surface of every node as binary glTF.

use crate::args::ExportArgs;
use crate::exported::Exported;
use voxtile_pipeline::{AnyMap, read_any_map};

use crate::output_file::{StagedOutput, is_standard_output, scratch_for};
use indicatif::HumanCount;
use rayon::prelude::*;
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use voxtile::mapper::MapView;
use voxtile::{Error, Result};
use voxtile_formats::write::{VoxelFileFormat, VoxelRow, VoxelsHead, WriteOptions, open_sink};
use voxtile_pipeline::Watch;
use voxtile_pipeline::memory;
use voxtile_render::levels::{Levels, LevelsOf, NodeKey, NodeStore, TilesetContent, subtree, tileset};

/// What was written.
#[derive(Default)]
struct Written {
    nodes: AtomicU64,
    /// Of the finest nodes.
    voxels: AtomicU64,
}

pub fn export(args: &ExportArgs, watch: &Watch) -> anyhow::Result<Exported> {
    check(args)?;
    let written = read_any_map(&args.map, |map| {
        let staged = StagedOutput::beside(&args.output)?;
        let folder = staged.path()?;
        let tiles = map.tile_indices();
        let progress = watch.over_tiles(tiles.len());
        let store = NodeStore::open(scratch_for(&args.output)?, &args.output)?;
        let levels =
            Levels::build(map, &tiles, 0, &store, &|_| !watch.stop().is_set())?.ok_or(Error::Stopped)?;
        if let Some(reason) = levels.unreadable().first() {
            // Whoever opens the folder would not know what is missing.
            return Err(anyhow::anyhow!("{reason}"));
        }
        let export = Export {
            map,
            levels: &levels,
            store: &store,
            folder: &folder,
            watch,
            written: Written::default(),
        };
        export.write(&|| progress.step())?;
        let written = export.written;
        staged.finish()?;
        Ok(written)
    })?;
    let folder = args.output.display().to_string();
    let (nodes, voxels) = (written.nodes.into_inner(), written.voxels.into_inner());
    let json = serde_json::json!({
        "file": folder,
        "format": "3dtiles",
        "nodes": nodes,
        "voxels": voxels,
        "peak_rss_bytes": memory::peak_bytes(),
    });
    let [voxels, nodes] = [voxels, nodes].map(HumanCount);
    Ok(Exported { json, text: format!("{voxels} voxels in {nodes} nodes in {folder}/tileset.json\n") })
}

/// A tileset is of the whole map.
fn check(args: &ExportArgs) -> Result<()> {
    if is_standard_output(&args.output) {
        return Err(Error::argument("--output", "3dtiles is a folder; name one"));
    }
    let is_part = args.region.is_some() || args.what.is_some() || args.min_probability.is_some();
    if is_part || args.origin.is_some() {
        let reason = "3dtiles holds what is occupied of the whole map, in true coordinates; make a map of a part with \
                      `voxtile crop`";
        return Err(Error::argument("--region, --what, --min-probability, --origin", reason));
    }
    Ok(())
}

struct Export<'a> {
    map: &'a AnyMap,
    levels: &'a Levels,
    store: &'a NodeStore,
    folder: &'a Path,
    watch: &'a Watch,
    written: Written,
}

impl Export<'_> {
    fn write(&self, next_tile: &(dyn Fn() + Sync)) -> Result<()> {
        self.make_folder(self.folder)?;
        let nodes = LevelsOf { levels: self.levels, map: self.map };
        let config = self.map.config();
        let extras = serde_json::json!({ "resolution_m": config.grid.resolution_m(), "crs": config.crs });
        let root = tileset(&nodes, self.store, TilesetContent::Meshes, extras)?;
        self.write_json(&self.folder.join("tileset.json"), &root)?;
        let heights_m = self.heights_m();
        self.levels.keys().into_par_iter().try_for_each(|key| {
            let within = self.levels.keys_within(self.map, self.store, key)?;
            if self.levels.is_tile(key) {
                next_tile();
            }
            for key in std::iter::once(key).chain(within) {
                self.watch.stop().check()?;
                self.write_node(key, heights_m)?;
            }
            Ok::<(), Error>(())
        })?;
        self.write_subtrees(&nodes, &root)
    }

    /// The files that a file names, and those that these name.
    fn write_subtrees(&self, nodes: &LevelsOf<'_, AnyMap>, file: &serde_json::Value) -> Result<()> {
        let mut open = vec![file["root"].clone()];
        while let Some(node) = open.pop() {
            open.extend(node["children"].as_array().into_iter().flatten().cloned());
            let uri = node["content"]["uri"].as_str().map(|uri| uri.trim_start_matches("../"));
            let key = uri.and_then(|uri| uri.strip_prefix("subtree/")?.strip_suffix(".json")?.parse().ok());
            if let Some(key) = key
                && let Some(file) = subtree(nodes, self.store, TilesetContent::Meshes, key)?
            {
                self.write_json(&self.folder.join(format!("subtree/{key}.json")), &file)?;
                open.push(file["root"].clone());
            }
        }
        Ok(())
    }

    fn write_node(&self, key: NodeKey, heights_m: [f64; 2]) -> Result<()> {
        let voxels = self.levels.voxels(self.map, self.store, key)?;
        let (edge_m, corner_m) = (self.levels.voxel_edge_m(key.level), self.levels.corner_m(key));
        let path = self.folder.join(format!("node/{key}.glb"));
        if let Some(folder) = path.parent() {
            self.make_folder(folder)?;
        }
        let head = VoxelsHead {
            voxels: voxels.len() as u64,
            resolution_m: edge_m,
            bounds_m: [[0.0; 3]; 2],
            occupied_log_odds: 0.0,
        };
        let mut options = WriteOptions::beside(&path);
        // Coordinates begin at the node's corner.
        options.colour_heights_m = Some(heights_m.map(|height| height - corner_m[2]));
        let mut sink = open_sink(VoxelFileFormat::Glb, &head, &path, &options).map_err(Error::from)?;
        for voxel in &voxels {
            sink.put(&VoxelRow {
                index: voxel.map(i32::from),
                center_m: voxel.map(|k| (f64::from(k) + 0.5) * edge_m),
                probability: 1.0,
                log_odds: 0.0,
                observation_count: 0,
                tile: [0; 3],
            })
            .map_err(Error::from)?;
        }
        sink.finish().map_err(Error::from)?;
        self.written.nodes.fetch_add(1, Ordering::Relaxed);
        if key.level == 0 {
            self.written.voxels.fetch_add(voxels.len() as u64, Ordering::Relaxed);
        }
        Ok(())
    }

    /// Of what is occupied, in metres.
    fn heights_m(&self) -> [f64; 2] {
        let boxes = self.levels.tops().iter().map(|&key| self.levels.bounds_m(self.store, key));
        boxes.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], around| {
            [low.min(around.min[2]), high.max(around.max[2])]
        })
    }

    fn make_folder(&self, folder: &Path) -> Result<()> {
        fs::create_dir_all(folder).map_err(|error| Error::io(folder, "create", error))
    }

    fn write_json(&self, path: &Path, value: &serde_json::Value) -> Result<()> {
        if let Some(folder) = path.parent() {
            self.make_folder(folder)?;
        }
        fs::write(path, value.to_string()).map_err(|error| Error::io(path, "write", error))
    }
}
