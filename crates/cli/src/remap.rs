use crate::args::{InsertName, ModelName, RemapArgs};
use crate::counted::Counted;
use crate::json;
use voxtile_pipeline::{MapAt, whole_map};

use crate::quiet::summary_out;
use crate::replay::{self, Job};
use indicatif::HumanCount;
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;
use voxtile::mapper::{KeptSummary, MapReader, MapView};
use voxtile::operations::{NewPoses, Remap, Remapped, rebuild_with_poses, remap};
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::{Error, InsertMode, MapConfig, MemoryLimit, RayConfig};
use voxtile_formats::Budget;
use voxtile_pipeline::memory;
use voxtile_pipeline::numbers::{Mount, tolerance_ns};
use voxtile_pipeline::place::url_of;
use voxtile_pipeline::{PoseFile, poses_for};

#[derive(Serialize)]
struct Summary<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    dry_run: bool,
    kept_as: Option<&'a str>,
    #[serde(flatten)]
    remapped: Remapped,
    seconds: f64,
    peak_rss_bytes: Option<u64>,
}

pub fn run(args: &RemapArgs) -> anyhow::Result<ExitCode> {
    if let Some(output) = &args.output {
        return build_another(args, output);
    }
    let Some(file) = &args.poses else {
        let reason = "give a file of new poses, or another map with -o";
        return Err(Error::argument("--poses", reason).into());
    };
    if let Some(url) = url_of(&args.map) {
        let reason = "a map in a bucket is read-only: build another map from its scans with -o, or `voxtile pull` it, \
                      change the copy, and `voxtile push` it";
        return Err(Error::argument(url, reason).into());
    }
    let map = whole_map(&args.map)?;
    let started = Instant::now();
    let tolerance = args.tolerance.as_deref().map(tolerance_of).transpose()?;
    let job = Job::of(&args.replay)?;
    let scans = KeptSummary::read(map)?;
    let poses = poses_for(&pose_file(args, file)?, &scans)?;
    let how = Remap::new(job.replay.clone()).with_tolerance(tolerance);
    let outcome = remap(&scans, &poses, &how, |done, all| job.progress.set(done, all));
    let remapped = match job.ended(outcome)? {
        Ok(remapped) => remapped,
        Err(code) => return Ok(code),
    };
    drop(job);
    let mut out = summary_out(args.replay.json || args.replay.dry_run);
    if args.replay.json {
        let summary = Summary {
            map,
            dry_run: args.replay.dry_run,
            kept_as: args.replay.keep_as.as_ref().map(|name| name.as_str()),
            remapped,
            seconds: started.elapsed().as_secs_f64(),
            peak_rss_bytes: memory::peak_bytes(),
        };
        json::print(&summary, &mut out)?;
        return Ok(ExitCode::SUCCESS);
    }
    let Remapped { mapped, largest_move_m, largest_turn_deg, .. } = remapped;
    let moved = if args.replay.dry_run { "would move" } else { "moved" };
    writeln!(
        out,
        "poses     {} {moved}, by up to {largest_move_m:.3} m and {largest_turn_deg:.3} degrees",
        Counted(mapped.scans_changed, "scan")
    )?;
    if remapped.scans_within_tolerance > 0 {
        writeln!(
            out,
            "left      {} unchanged: new poses differ by up to {:.3} m and {:.3} degrees",
            Counted(remapped.scans_within_tolerance, "scan"),
            remapped.largest_move_left_m,
            remapped.largest_turn_left_deg
        )?;
    }
    replay::print(&mapped, args.replay.dry_run, &mut out)?;
    if let Some(name) =
        args.replay.keep_as.as_ref().filter(|_| mapped.scans_changed > 0 && !args.replay.dry_run)
    {
        writeln!(out, "before    kept as {name}")?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Parses two tolerances such as `0.02m,0.1deg`. Returns metres and radians.
fn tolerance_of(text: &str) -> voxtile::Result<(f64, f64)> {
    let number = |part: &str, unit: &str| -> Option<f64> {
        part.trim().strip_suffix(unit)?.trim().parse().ok().filter(|&x: &f64| x >= 0.0 && x.is_finite())
    };
    let parts = text.split_once(',');
    let tolerance = parts.and_then(|(moved, turned)| Some((number(moved, "m")?, number(turned, "deg")?)));
    let (moved_m, turned_deg) = tolerance.ok_or_else(|| {
        Error::argument("--tolerance", format!("{text:?} is not a length and an angle such as 0.02m,0.1deg"))
    })?;
    Ok((moved_m, turned_deg.to_radians()))
}

/// Builds another map from the same scans.
fn build_another(args: &RemapArgs, output: &Path) -> anyhow::Result<ExitCode> {
    if args.replay.keep_as.is_some() || args.replay.dry_run {
        let reason = "cannot be combined with -o, which does not change the map";
        return Err(Error::argument("--keep-as, --dry-run", reason).into());
    }
    let job = Job::of(&args.replay)?;
    let reader = MapAt::of(&args.map)?.open()?;
    let config = config_of(args, reader.config(), job.replay.memory)?;
    let rays = |rays: &RayConfig| rays_of(args, rays);
    let poses = match &args.poses {
        Some(file) => poses_for(&pose_file(args, file)?, &reader.kept_summary()?)?,
        None => NewPoses::Numbered(Vec::new()),
    };
    let progress = |done, all| job.progress.set(done, all);
    let stop = &job.replay.stop;
    let outcome = rebuild_with_poses(&reader, whole_map(output)?, config, rays, &poses, stop, progress);
    let mapped = match job.ended(outcome)? {
        Ok(mapped) => mapped,
        Err(code) => return Ok(code),
    };
    drop(job);
    let mut out = summary_out(args.replay.json);
    if args.replay.json {
        json::print(&mapped, &mut out)?;
        return Ok(ExitCode::SUCCESS);
    }
    let (scans, points) = (Counted(mapped.scans, "scan"), Counted(mapped.report.points, "point"));
    writeln!(out, "mapped    {scans}, {points}, to {}", output.display())?;
    for (layer, count) in mapped.scans_without.by_layer().into_iter().filter(|(_, count)| *count > 0) {
        writeln!(out, "layers    {} without data for {layer}", Counted(count, "scan"))?;
    }
    let (voxels, occupied) = MapReader::open(output, 0)?.voxel_counts().unwrap_or_default();
    writeln!(out, "map       {} voxels, {} occupied", HumanCount(voxels), HumanCount(occupied))?;
    Ok(ExitCode::SUCCESS)
}

fn config_of(args: &RemapArgs, own: &MapConfig, memory: MemoryLimit) -> anyhow::Result<MapConfig> {
    let grid = own.grid.replaced(args.resolution, args.tile_size).map_err(Error::from)?;
    let mut config = own.clone().with_kept_scans(args.keep_scans);
    (config.grid, config.memory) = (grid, memory);
    config.layers = args.layers.or(config.layers);
    if let Some(storage) = args.storage {
        config.storage = storage.into();
    }
    config.sensor_model = match (args.sensor_model, own.sensor_model) {
        (None, own) => own,
        (Some(ModelName::LogOdds), SensorModel::LogOdds(own)) => SensorModel::LogOdds(own),
        (Some(ModelName::Iwlo), SensorModel::Iwlo(own)) => SensorModel::Iwlo(own),
        (Some(ModelName::LogOdds), _) => SensorModel::default(),
        (Some(ModelName::Iwlo), _) => SensorModel::Iwlo(Iwlo::default()),
    };
    Ok(config.validated()?)
}

fn rays_of(args: &RemapArgs, own: &RayConfig) -> RayConfig {
    let mut rays = *own;
    rays.min_range_m = args.min_range.unwrap_or(rays.min_range_m);
    rays.max_range_m = args.max_range.or(rays.max_range_m);
    rays.insert_mode = match args.insert {
        Some(InsertName::PerScan) => InsertMode::PerScan,
        Some(InsertName::PerRay) => InsertMode::PerRay,
        None => rays.insert_mode,
    };
    rays.clearing = args.clearing.map(Into::into).or(rays.clearing);
    rays
}

/// Returns the options for reading the new poses.
fn pose_file<'a>(args: &'a RemapArgs, path: &'a Path) -> voxtile::Result<PoseFile<'a>> {
    let body_from_sensor = args.extrinsic.as_deref().map(Mount::of).transpose()?.map(|mount| mount.rigid);
    let tolerance_ns = tolerance_ns(args.pose_tolerance)?;
    // Next to the map, as in builds: the system's temporary folder may be in memory.
    let map = args.output.as_ref().unwrap_or(&args.map);
    let scratch = map.ancestors().skip(1).find(|folder| folder.is_dir()).unwrap_or(Path::new("."));
    let budget = Budget { scratch: Some(scratch.to_owned()), ..Budget::default() };
    let which = args.interpolate.unwrap_or_default();
    Ok(PoseFile { path, calib: args.calib.as_deref(), body_from_sensor, tolerance_ns, budget, which })
}
