use crate::args::RevertArgs;
use crate::counted::Counted;
use crate::json;
use crate::progress::Progress;
use crate::quiet::summary_out;
use indicatif::HumanCount;
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use voxtile::operations::{Reverted, revert};
use voxtile_pipeline::memory;
use voxtile_pipeline::whole_map;

#[derive(Serialize)]
struct Summary<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    snapshot: &'a str,
    kept_as: Option<&'a str>,
    #[serde(flatten)]
    reverted: Reverted,
    peak_rss_bytes: Option<u64>,
}

pub fn run(args: &RevertArgs) -> anyhow::Result<ExitCode> {
    let progress = Progress::over_tiles(0);
    let keep_as = args.keep_as.as_ref();
    let reverted = revert(whole_map(&args.map)?, &args.name, keep_as, |done, all| progress.set(done, all))?;
    drop(progress);
    let mut out = summary_out(args.json);
    if args.json {
        let (snapshot, kept_as) = (args.name.as_str(), keep_as.map(|name| name.as_str()));
        let summary =
            Summary { map: &args.map, snapshot, kept_as, reverted, peak_rss_bytes: memory::peak_bytes() };
        json::print(&summary, &mut out)?;
        return Ok(ExitCode::SUCCESS);
    }
    let Reverted { scan_number_before, scan_number, tiles, tiles_restored, tiles_removed, .. } = reverted;
    let (restored, removed) = (HumanCount(tiles_restored), HumanCount(tiles_removed));
    if reverted.was_done {
        writeln!(out, "reverted  nothing: the map already equals {}, scan {scan_number}", args.name)?;
        return Ok(ExitCode::SUCCESS);
    }
    writeln!(out, "reverted  to {}: scan {scan_number}, {}", args.name, Counted(tiles, "tile"))?;
    writeln!(out, "tiles     {restored} restored, {removed} removed")?;
    match keep_as {
        Some(name) => writeln!(out, "before    scan {scan_number_before}; kept as {name}")?,
        None => writeln!(out, "before    scan {scan_number_before}; not kept")?,
    }
    Ok(ExitCode::SUCCESS)
}
