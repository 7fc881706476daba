use crate::args::VolumeArgs;
use crate::json;
use crate::part::region_of;
use crate::progress::Progress;
use crate::quiet::summary_out;
use crate::stop_signal;
use anyhow::bail;
use serde::Serialize;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;
use voxtile_compare::{VolumeOptions, VolumeSums, Volumes, volumes, volumes_over_plane};
use voxtile_pipeline::{AnyMap, PolygonFile, check_crs, memory, read_any_map, read_any_maps};

#[derive(Serialize)]
struct Report<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    /// The later map, if there is one.
    #[serde(serialize_with = "optional_path")]
    after: Option<&'a Path>,
    /// Height of the plane in metres, if there is one.
    plane_m: Option<f64>,
    #[serde(flatten)]
    volumes: Volumes,
    seconds: f64,
    peak_rss_bytes: Option<u64>,
}

/// Computes the volume between two maps, or over a plane, and prints it.
pub fn run(args: &VolumeArgs) -> anyhow::Result<ExitCode> {
    let started = Instant::now();
    let options = VolumeOptions::default()
        .with_least(args.least)
        .with_region(args.region.as_deref().map(region_of).transpose()?)
        .with_memory(usize::try_from(args.memory.as_u64()).unwrap_or(usize::MAX))
        .with_stop(stop_signal::catch_unfinished()?);
    let polygons = args.polygon.as_deref().map(PolygonFile::read).transpose()?;
    let options_in = |map: &AnyMap| -> anyhow::Result<VolumeOptions> {
        Ok(options.clone().with_area(polygons.as_ref().map(|file| file.area_in(map)).transpose()?))
    };
    let progress = Progress::over_blocks();
    let step = |done, all| progress.set(done, all);
    let found = match (&args.after, args.plane) {
        (Some(after), None) => read_any_maps(&args.map, after, |old, new| {
            check_crs([(&args.map, old), (after, new)])?;
            Ok(volumes(old, new, &options_in(old)?, &step)?)
        })?,
        (None, Some(plane_m)) => {
            read_any_map(&args.map, |map| Ok(volumes_over_plane(map, plane_m, &options_in(map)?, &step)?))?
        }
        _ => bail!("a later map, or a height with --plane is needed"),
    };
    drop(progress);
    if found.measured.area_m2 == 0.0 && found.open.area_m2 > 0.0 {
        log::warn!(
            "no voxel above a surface was seen free, as in maps without rays (build --no-rays): the volumes assume that \
             nothing is there"
        );
    }
    let mut out = summary_out(args.json);
    if args.json {
        let report = Report {
            map: &args.map,
            after: args.after.as_deref(),
            plane_m: args.plane,
            volumes: found,
            seconds: started.elapsed().as_secs_f64(),
            peak_rss_bytes: memory::peak_bytes(),
        };
        json::print(&report, &mut out)?;
    } else {
        print(&found, args, &mut out)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn print(found: &Volumes, args: &VolumeArgs, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "{:<12} {:>12} {:>12} {:>12} {:>12}", "columns", "area m2", "fill m3", "cut m3", "net m3")?;
    let mut row = |name: &str, sums: &VolumeSums| {
        let VolumeSums { area_m2, fill_m3, cut_m3, net_m3, .. } = sums;
        writeln!(out, "{name:<12} {area_m2:>12.2} {fill_m3:>12.3} {cut_m3:>12.3} {net_m3:>+12.3}")
    };
    row("measured", &found.measured)?;
    row("top not seen", &found.open)?;
    if args.after.is_some() {
        writeln!(out, "{:<12} {:>12.2}", "only before", found.only_before_m2)?;
        writeln!(out, "{:<12} {:>12.2}", "only after", found.only_after_m2)?;
    }
    let share = 100.0 * found.measured_share;
    writeln!(out, "{:<12} {:>12.2}, {share:.1} % measured", "whole area", found.area_m2)
}

fn optional_path<S: serde::Serializer>(path: &Option<&Path>, serializer: S) -> Result<S::Ok, S::Error> {
    match path {
        Some(path) => voxtile::path_text::serialize(path, serializer),
        None => serializer.serialize_none(),
    }
}
