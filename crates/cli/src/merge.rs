use crate::args::MergeArgs;
use crate::json;
use voxtile_pipeline::{read_all_maps, whole_map};

use crate::progress::Progress;
use crate::quiet::summary_out;
use crate::written::{print_written, warn_of_scans_left};
use indicatif::HumanCount;
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use voxtile::operations::{Merged, merge};
use voxtile_pipeline::memory;

#[derive(Serialize)]
struct Summary<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    #[serde(flatten)]
    merged: Merged,
    warnings: Vec<String>,
    peak_rss_bytes: Option<u64>,
}

pub fn run(args: &MergeArgs) -> anyhow::Result<ExitCode> {
    let progress = Progress::over_tiles(0);
    let prefer = args.prefer.map(Into::into);
    let (merged, mut warnings) = read_all_maps(&args.maps, |maps| {
        let merged = merge(maps, whole_map(&args.output)?, prefer, |done, all| progress.set(done, all))?;
        let warnings = if merged.keeps_scans { Vec::new() } else { warn_of_scans_left(maps) };
        Ok((merged, warnings))
    })?;
    drop(progress);
    for warning in warnings_of(&args.maps, &merged) {
        log::warn!("{warning}");
        warnings.push(warning);
    }
    let mut out = summary_out(args.json);
    if args.json {
        let peak_rss_bytes = memory::peak_bytes();
        let summary = Summary { map: &args.output, merged, warnings, peak_rss_bytes };
        json::print(&summary, &mut out)?;
    } else {
        print_written(&args.output, &merged.written, &mut out)?;
        writeln!(
            out,
            "merged    {} maps, {} voxels in two or more",
            args.maps.len(),
            HumanCount(merged.common_voxels)
        )?;
        if merged.is_one_build {
            writeln!(
                out,
                "scans     those of each map: regions of one build, which build --resume can continue"
            )?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn warnings_of(maps: &[PathBuf], merged: &Merged) -> Vec<String> {
    let related = merged.related.iter().filter(|_| merged.is_added);
    let warning = |&(earlier, later): &(usize, usize)| {
        format!(
            "{} and {} share history: common evidence counts twice; use --prefer to count it once",
            maps[earlier].display(),
            maps[later].display()
        )
    };
    related.map(warning).collect()
}
