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
use voxtile::operations::{WrittenMap, crop};
use voxtile_pipeline::memory;

#[derive(Serialize)]
struct Summary<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    #[serde(flatten)]
    written: WrittenMap,
    warnings: Vec<String>,
    peak_rss_bytes: Option<u64>,
}

pub fn run(args: &CropArgs) -> anyhow::Result<ExitCode> {
    let progress = Progress::over_tiles(0);
    let (part, output) = (part_of(&args.part)?, whole_map(&args.output)?);
    let (written, warnings) = read_map(&args.map, |map| {
        let written = crop(map, &part, output, |done, all| progress.set(done, all))?;
        Ok((written, warn_of_scans_left([map])))
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
