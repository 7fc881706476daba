use crate::{Arguments, npy, recorded};
use anyhow::{Context, Result};
use report::Stopwatch;
use std::fs;
use std::path::Path;
use voxtile::mapper::MapView;
use voxtile::{Aabb, MapOptions, MapReader, Mapper};
use voxtile_distance::{DistanceOptions, FieldOptions, MapDistances, UnknownRule, compute_field};

/// Largest box in memory, in voxels along x, y and z: the peers need about 50 bytes per voxel.
const MAX_BOX: [i32; 3] = [512, 512, 128];

pub fn measure(arguments: &Arguments, work: &Path) -> Result<()> {
    let map_folder = work.join("map");
    let mut mapper =
        MapOptions::new().config(recorded::config(arguments)?).create_if_missing(true).open(&map_folder)?;
    recorded::for_each_scan(arguments, |scan| {
        mapper.insert_scan(scan)?;
        Ok(())
    })?;
    mapper.flush()?;
    drop(mapper);
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    one_thread.install(|| {
        for unknown in [UnknownRule::Unknown, UnknownRule::Free] {
            in_folder(arguments, &map_folder, &work.join(format!("field_{unknown:?}")), unknown)?;
        }
        in_memory(arguments, &map_folder, work)
    })
}

fn in_folder(arguments: &Arguments, map: &Path, folder: &Path, unknown: UnknownRule) -> Result<()> {
    let map = MapReader::open(map, 64 << 20)?;
    let options = FieldOptions::new(DistanceOptions::new(arguments.cap).with_unknown(unknown));
    let clock = Stopwatch::start()?;
    let report = compute_field(&map, folder, &options, &|_, _| {})?;
    let cpu_s = clock.stop()?.cpu_s();
    let clock = Stopwatch::start()?;
    compute_field(&map, folder, &options, &|_, _| {})?;
    let again_s = clock.stop()?.cpu_s();
    let mut bytes = 0;
    for entry in fs::read_dir(folder.join("tiles"))? {
        bytes += entry?.metadata()?.len();
    }
    println!(
        "| `{}` | folder, unknown as {} | {} | {} | {:.1} | {:.2} | {:.1} | {again_s:.2} s for a second call, {:.2} bytes per voxel |",
        recorded::name(arguments),
        format!("{unknown:?}").to_lowercase(),
        arguments.resolution,
        arguments.cap,
        report.voxels_computed as f64 / 1e6,
        cpu_s,
        report.voxels_computed as f64 / 1e6 / cpu_s,
        bytes as f64 / report.voxels_computed as f64,
    );
    Ok(())
}

fn in_memory(arguments: &Arguments, map: &Path, work: &Path) -> Result<()> {
    let map = MapReader::open(map, 64 << 20)?;
    let grid = map.config().grid;
    let bounds = grid.voxels_of_tiles(map.tile_bounds().context("the map is empty")?);
    let middle: [i32; 3] = std::array::from_fn(|k| bounds.min[k] + (bounds.end[k] - bounds.min[k]) / 2);
    let low: [i32; 3] = std::array::from_fn(|k| bounds.min[k].max(middle[k] - MAX_BOX[k] / 2));
    let high: [i32; 3] = std::array::from_fn(|k| bounds.end[k].min(middle[k] + MAX_BOX[k] / 2));
    let metres = |k: i32| f64::from(k) * grid.resolution_m();
    let region = Aabb { min: low.map(metres), max: high.map(metres) };
    let options = DistanceOptions::new(arguments.cap).with_unknown(UnknownRule::Free);
    let clock = Stopwatch::start()?;
    let field = map.distance_field(&region, options)?;
    let cpu_s = clock.stop()?.cpu_s();
    let distances = field.to_array();
    println!(
        "| `{}` | box in memory | {} | {} | {:.1} | {:.2} | {:.1} | reads the map; obstacles around the box count |",
        recorded::name(arguments),
        arguments.resolution,
        arguments.cap,
        distances.len() as f64 / 1e6,
        cpu_s,
        distances.len() as f64 / 1e6 / cpu_s,
    );
    let shape = [2, 1, 0].map(|k| (high[k] - low[k]) as usize);
    let planes = || distances.chunks(shape[1] * shape[2]);
    let bits = |plane: &[_]| {
        plane
            .iter()
            .flat_map(|distance: &voxtile_distance::VoxelDistance| distance.to_bits().to_le_bytes())
            .collect()
    };
    npy::write(&work.join("distances.npy"), shape, "<i2", planes().map(bits))?;
    let obstacles = |plane: &[voxtile_distance::VoxelDistance]| {
        plane.iter().map(|distance| u8::from(distance.to_bits() == 0)).collect()
    };
    npy::write(&work.join("obstacles.npy"), shape, "|u1", planes().map(obstacles))?;
    Ok(())
}
