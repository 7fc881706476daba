use crate::args::CropArgs;
use crate::json;
use voxtile_pipeline::{read_map, whole_map};

use crate::part::part_of;
use crate::progress::Progress;
use crate::quiet::summary_out;
use crate::written::{print_written, warn_of_scans_left};
use serde::Serialize;
use std::path::Path;
use std::process::ExitCode;
use voxtile::operations::{AreaPart, CopyScans, Part, WrittenMap, crop, crop_area};
use voxtile_pipeline::{PolygonFile, memory};

#[derive(Serialize)]
struct Summary<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    #[serde(flatten)]
    written: WrittenMap,
    warnings: Vec<String>,
    peak_rss_bytes: Option<u64>,
}

/// Voxels to keep.
enum Selected {
    Box(Part),
    /// Polygons, and the range of heights in metres.
    Polygon(Box<PolygonFile>, [f64; 2]),
}

impl Selected {
    fn of(args: &CropArgs) -> anyhow::Result<Self> {
        let Some(path) = &args.polygon else {
            return Ok(Self::Box(part_of(args.region.as_deref().unwrap_or_default(), args.outside)?));
        };
        let z_m = match args.z.as_deref() {
            Some(&[min_m, max_m]) => [min_m, max_m],
            _ => [f64::NEG_INFINITY, f64::INFINITY],
        };
        Ok(Self::Polygon(Box::new(PolygonFile::read(path)?), z_m))
    }
}

pub fn run(args: &CropArgs) -> anyhow::Result<ExitCode> {
    let progress = Progress::over_tiles(0);
    let (part, output) = (Selected::of(args)?, whole_map(&args.output)?);
    let scans = if args.keep_scans { CopyScans::Yes } else { CopyScans::No };
    let (written, warnings) = read_map(&args.map, |map| {
        if args.keep_scans {
            map.kept_scans()?;
        }
        let report = |done, all| progress.set(done, all);
        let written = match &part {
            Selected::Box(part) => crop(map, part, scans, output, report)?,
            Selected::Polygon(file, z_m) => {
                let (area, z_m) = (file.area_in(map)?, *z_m);
                crop_area(map, &AreaPart { area, z_m, is_outside: args.outside }, scans, output, report)?
            }
        };
        let warnings = if args.keep_scans { Vec::new() } else { warn_of_scans_left([map]) };
        Ok((written, warnings))
    })?;
    drop(progress);
    let mut out = summary_out(args.json);
    if args.json {
        let peak_rss_bytes = memory::peak_bytes();
        let summary = Summary { map: &args.output, written, warnings, peak_rss_bytes };
        json::print(&summary, &mut out)?;
    } else {
        print_written(&args.output, &written, &mut out)?;
    }
    Ok(ExitCode::SUCCESS)
}
