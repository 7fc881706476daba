//! Export to a 3D Tiles folder: `tileset.json`, and the surface of every node as binary glTF.

use super::run::Export;
use super::summary::{ExportSummary, Written};
use crate::output::{StagedOutput, scratch_for};
use crate::watch::Watch;
use crate::{AnyMap, read_any_map};
use rayon::prelude::*;
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use voxtile::mapper::MapView;
use voxtile::{Error, Layers, Result};
use voxtile_formats::write::{OutputFormat, RowLayers, VoxelRow, VoxelsHead, WriteOptions};
use voxtile_render::levels::{
    ColouredVoxel, Levels, LevelsOf, NodeKey, NodeStore, TilesetContent, for_each_subtree, tileset,
};

/// Numbers of nodes and voxels written.
#[derive(Default)]
struct Counts {
    nodes: AtomicU64,
    /// Voxels of the finest nodes.
    voxels: AtomicU64,
}

/// Writes the folder atomically.
pub(super) fn export(export: &Export<'_>) -> anyhow::Result<ExportSummary> {
    let (output, watch) = (&export.options.output, export.watch);
    let counts = read_any_map(&export.options.map, |map| {
        let staged = StagedOutput::beside(output)?;
        let folder = staged.path()?;
        let tiles = map.tile_indices();
        let progress = watch.over_tiles(tiles.len());
        let store = NodeStore::open(scratch_for(output)?, output)?;
        let levels =
            Levels::build(map, &tiles, 0, &store, &|_| !watch.stop().is_set())?.ok_or(Error::Stopped)?;
        if let Some(reason) = levels.unreadable().first() {
            // An incomplete tileset would not be recognisable as such.
            return Err(anyhow::anyhow!("{reason}"));
        }
        let tileset = Tileset {
            map,
            levels: &levels,
            store: &store,
            folder: &folder,
            watch,
            layers: Layers {
                colour: export.options.with_layers && map.config().layers().colour,
                ..Layers::NONE
            },
            counts: Counts::default(),
        };
        tileset.write(&|| progress.step())?;
        let counts = tileset.counts;
        staged.finish()?;
        Ok(counts)
    })?;
    let (nodes, voxels) = (counts.nodes.into_inner(), counts.voxels.into_inner());
    Ok(export.summary(voxels, Written::Tileset { format: export.format.name, nodes }))
}

struct Tileset<'a> {
    map: &'a AnyMap,
    levels: &'a Levels,
    store: &'a NodeStore,
    folder: &'a Path,
    watch: &'a Watch,
    /// Layers to write: colour, or none.
    layers: Layers,
    counts: Counts,
}

impl Tileset<'_> {
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
        let mut write =
            |key, file: &_| self.write_json(&self.folder.join(format!("subtree/{key}.json")), file);
        for_each_subtree(&nodes, self.store, TilesetContent::Meshes, &root, &mut write)
    }

    fn write_node(&self, key: NodeKey, heights_m: [f64; 2]) -> Result<()> {
        let voxels = self.voxels(key)?;
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
            layers: self.layers,
        };
        let mut options = WriteOptions::for_path(&path);
        // Coordinates are relative to the node's corner.
        options.colour_heights_m = Some(heights_m.map(|height| height - corner_m[2]));
        // Viewers of 3D Tiles support quantized positions, which make the folder a fifth smaller.
        options.is_quantized = true;
        let mut sink = OutputFormat::GLB.open(&head, &path, &options)?;
        for &(voxel, colour) in &voxels {
            sink.put(&VoxelRow {
                index: voxel.map(i32::from),
                center_m: voxel.map(|k| (f64::from(k) + 0.5) * edge_m),
                probability: 1.0,
                log_odds: 0.0,
                observation_count: 0,
                tile: [0; 3],
                layers: RowLayers { colour, ..RowLayers::NONE },
            })?;
        }
        sink.finish()?;
        self.counts.nodes.fetch_add(1, Ordering::Relaxed);
        if key.level == 0 {
            self.counts.voxels.fetch_add(voxels.len() as u64, Ordering::Relaxed);
        }
        Ok(())
    }

    /// Returns the voxels of a node, with the colours to write.
    fn voxels(&self, key: NodeKey) -> Result<Vec<ColouredVoxel>> {
        if self.layers.colour {
            return self.levels.coloured_voxels(self.map, self.store, key);
        }
        let voxels = self.levels.voxels(self.map, self.store, key)?;
        Ok(voxels.into_iter().map(|voxel| (voxel, None)).collect())
    }

    /// Returns the range of heights of occupied voxels, in metres.
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
