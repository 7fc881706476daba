//! Exports the occupied voxels of a map as PLY, with progress output and a way to stop: `cargo run --release --example
//! exporter -- map_tiles_example occupied.ply`.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use voxtile::{MapOptions, MapView, Occupancy};
use voxtile_formats::write::{OutputFormats, RowLayers, VoxelRow, VoxelsHead, WriteOptions};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [map, file] = arguments.as_slice() else {
        return Err("usage: exporter MAP FILE.ply; Enter stops it".into());
    };
    let map = MapOptions::new().memory_bytes(64 << 20).open_read_only(map)?;
    let (_, occupied) =
        map.voxel_counts().ok_or("a map of the original format; `voxtile build` upgrades it")?;
    let stop = Arc::new(AtomicBool::new(false));
    let asked = stop.clone();
    thread::spawn(move || {
        // The end of the input does not stop the export.
        let is_line = std::io::stdin().read_line(&mut String::new()).is_ok_and(|bytes| bytes > 0);
        asked.store(is_line, Ordering::Relaxed);
    });

    let (grid, path) = (map.config().grid, Path::new(file));
    let formats = OutputFormats::default();
    let format = formats.of_name("ply").ok_or("without PLY")?;
    let head = VoxelsHead::of_stream(occupied, grid.resolution_m());
    let mut out = format.open(&head, path, &WriteOptions::for_path(path))?;
    let all = map.tile_indices().len();
    for (done, tile) in map.tiles().enumerate() {
        if stop.load(Ordering::Relaxed) {
            drop(out);
            std::fs::remove_file(file)?;
            return Err("stopped; no file was written".into());
        }
        for voxel in tile?.voxels() {
            let found = Occupancy::of(map.config(), Some(voxel.evidence));
            if let Occupancy::Occupied(probability) = found {
                out.put(&VoxelRow {
                    index: voxel.index,
                    center_m: grid.center_m(voxel.index),
                    probability,
                    log_odds: voxel.evidence.log_odds,
                    observation_count: voxel.evidence.observation_count,
                    tile: grid.tile_of_voxel(voxel.index).to_array(),
                    layers: RowLayers::default(),
                })?;
            }
        }
        eprint!("\r{} of {all} tiles", done + 1);
    }
    out.finish()?;
    eprintln!("; {occupied} voxels");
    Ok(())
}
