use crate::args::DecayArgs;
use crate::counted::Counted;
use crate::json;
use crate::progress::Progress;
use crate::quiet::summary_out;
use indicatif::HumanCount;
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use voxtile::operations::{Decay, Decayed, decay};
use voxtile_pipeline::memory;
use voxtile_pipeline::whole_map;

#[derive(Serialize)]
struct Summary<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    #[serde(flatten)]
    decayed: Decayed,
    peak_rss_bytes: Option<u64>,
}

pub fn run(args: &DecayArgs) -> anyhow::Result<ExitCode> {
    let mut rule = Decay::new(args.halflife).with_forget_below(args.forget_below.unwrap_or(0.0));
    rule.scans = args.scans;
    let progress = Progress::over_tiles(0);
    let decayed = decay(whole_map(&args.map)?, &rule, |done, all| progress.set(done, all))?;
    drop(progress);
    let mut out = summary_out(args.json);
    if args.json {
        let summary = Summary { map: &args.map, decayed, peak_rss_bytes: memory::peak_bytes() };
        json::print(&summary, &mut out)?;
    } else {
        let Decayed { scans, factor, voxels, voxels_forgotten, tiles, tiles_removed, .. } = decayed;
        writeln!(out, "decayed   by {}: log-odds times {factor:.6}", Counted(scans, "scan"))?;
        if scans == 0 {
            writeln!(out, "          no scans since the last decay; --scans N sets the number")?;
        }
        writeln!(out, "voxels    {}; {} forgotten", HumanCount(voxels), HumanCount(voxels_forgotten))?;
        writeln!(
            out,
            "tiles     {}; {} became empty and were removed",
            HumanCount(tiles),
            HumanCount(tiles_removed)
        )?;
    }
    Ok(ExitCode::SUCCESS)
}
