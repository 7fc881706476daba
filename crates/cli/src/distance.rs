use crate::args::DistanceArgs;
use crate::counted::Counted;
use crate::json;
use crate::part::region_of;
use crate::progress::Progress;
use crate::quiet::summary_out;
use crate::stop_signal;
use indicatif::HumanCount;
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;
use voxtile::mapper::MapView;
use voxtile::scan::Stop;
use voxtile::{Aabb, Error, Result};
use voxtile_distance::{
    DistanceField, DistanceOptions, FieldOptions, FieldReader, FieldReport, MapDistances, UnknownRule,
    compute_field,
};
use voxtile_pipeline::{AnyMap, layer_of, memory, read_any_map, write_distances_npz, write_distances_png};

#[derive(Serialize)]
struct Summary<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    field: Option<String>,
    max_distance_m: f64,
    unknown: UnknownRule,
    signed: bool,
    /// `None` without a folder.
    #[serde(flatten)]
    report: Option<FieldReport>,
    npz: Option<String>,
    png: Option<String>,
    seconds: f64,
    peak_rss_bytes: Option<u64>,
}

/// Computes a distance field in a folder, files of a box, or both.
pub fn run(args: &DistanceArgs) -> anyhow::Result<ExitCode> {
    let started = Instant::now();
    let stop = stop_signal::catch_unfinished()?;
    let region = args.region.as_deref().map(region_of).transpose()?;
    let distances =
        DistanceOptions::new(args.max_distance).with_unknown(args.unknown.into()).with_sign(args.signed);
    let report = read_any_map(&args.map, |map| {
        let report = match &args.output {
            Some(folder) => Some(compute(map, folder, args, distances, region, &stop)?),
            None => None,
        };
        write_files(map, args, distances, region)?;
        Ok(report)
    })?;
    for problem in report.iter().flat_map(|report| &report.damaged_map_tiles) {
        log::warn!("{problem}; the distances around it are unknown");
    }
    for problem in report.iter().flat_map(|report| &report.damaged_field_tiles) {
        log::warn!("{problem}; it was computed again");
    }
    let mut out = summary_out(args.json);
    if args.json {
        let name = |path: &Option<std::path::PathBuf>| path.as_ref().map(|path| path.display().to_string());
        let summary = Summary {
            map: &args.map,
            field: name(&args.output),
            max_distance_m: args.max_distance,
            unknown: args.unknown.into(),
            signed: args.signed,
            report,
            npz: name(&args.npz),
            png: name(&args.png),
            seconds: started.elapsed().as_secs_f64(),
            peak_rss_bytes: memory::peak_bytes(),
        };
        json::print(&summary, &mut out)?;
        return Ok(ExitCode::SUCCESS);
    }
    print(args, report.as_ref(), started.elapsed().as_secs_f64(), &mut out)?;
    Ok(ExitCode::SUCCESS)
}

fn compute(
    map: &AnyMap,
    folder: &Path,
    args: &DistanceArgs,
    distances: DistanceOptions,
    region: Option<Aabb>,
    stop: &Stop,
) -> Result<FieldReport> {
    let map_id = match map {
        AnyMap::Map(reader) => reader.metadata().ext.as_ref().map(|ext| ext.map_id.clone()),
        AnyMap::Octree(_) => None,
    };
    let options = FieldOptions::new(distances)
        .with_region(region)
        .with_memory(usize::try_from(args.memory.as_u64()).unwrap_or(usize::MAX))
        .with_map_id(map_id)
        .with_stop(stop.clone());
    let progress = Progress::over_tiles(0);
    compute_field(map, folder, &options, &|done, all| progress.set(done, all))
}

/// Writes the files of the box.
fn write_files(
    map: &AnyMap,
    args: &DistanceArgs,
    distances: DistanceOptions,
    region: Option<Aabb>,
) -> anyhow::Result<()> {
    if args.npz.is_none() && args.png.is_none() {
        return Ok(());
    }
    let grid = map.config().grid;
    let Some(bounds) = map.tile_bounds() else {
        return Err(Error::argument(args.map.display().to_string(), "the map is empty").into());
    };
    let voxels = grid.voxels_of_tiles(bounds);
    let metres = |k: i32| f64::from(k) * grid.resolution_m();
    let whole = Aabb { min: voxels.min.map(metres), max: voxels.end.map(metres) };
    let region = region.unwrap_or(whole);
    let load = |region: &Aabb| -> Result<DistanceField> {
        match &args.output {
            Some(folder) => FieldReader::open(folder, args.memory.as_u64() as usize)?.load(region),
            None => map.distance_field(region, distances),
        }
    };
    if let Some(path) = &args.npz {
        write_distances_npz(&load(&region)?, path)?;
    }
    if let (Some(path), Some(z_m)) = (&args.png, args.slice_z) {
        write_distances_png(&load(&layer_of(&grid, region, z_m)?)?, path)?;
    }
    Ok(())
}

fn print(
    args: &DistanceArgs,
    report: Option<&FieldReport>,
    seconds: f64,
    out: &mut impl Write,
) -> anyhow::Result<()> {
    if let (Some(report), Some(folder)) = (report, &args.output) {
        let (tiles, computed) = (Counted(report.tiles, "tile"), Counted(report.tiles_computed, "tile"));
        let voxels = HumanCount(report.voxels_computed);
        writeln!(out, "field     {tiles} in {}", folder.display())?;
        writeln!(out, "computed  {computed}, {voxels} voxels, in {seconds:.1} s")?;
        if report.tiles_kept > 0 {
            writeln!(
                out,
                "kept      {}: nothing within the cap has changed",
                Counted(report.tiles_kept, "tile")
            )?;
        }
        if !report.has_obstacles {
            writeln!(out, "note      the map has no obstacles: all distances are beyond the cap or unknown")?;
        }
        if !report.damaged_map_tiles.is_empty() {
            let damaged = Counted(report.damaged_map_tiles.len() as u64, "damaged tile");
            writeln!(out, "note      {damaged} of the map: distances nearby are unknown")?;
        }
    }
    for path in [&args.npz, &args.png].into_iter().flatten() {
        writeln!(out, "wrote     {}", path.display())?;
    }
    Ok(())
}
