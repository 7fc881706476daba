use crate::args::ClearArgs;
use crate::counted::Counted;
use crate::json;
use crate::part::part_of;
use crate::progress::Progress;
use crate::quiet::summary_out;
use indicatif::HumanCount;
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use voxtile::operations::{Cleared, clear};
use voxtile_pipeline::memory;
use voxtile_pipeline::whole_map;

#[derive(Serialize)]
struct Summary<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    #[serde(flatten)]
    cleared: Cleared,
    peak_rss_bytes: Option<u64>,
}

pub fn run(args: &ClearArgs) -> anyhow::Result<ExitCode> {
    let progress = Progress::over_tiles(0);
    let cleared =
        clear(whole_map(&args.map)?, &part_of(&args.part.region, args.part.outside)?, |done, all| {
            progress.set(done, all)
        })?;
    drop(progress);
    let mut out = summary_out(args.json);
    if args.json {
        let summary = Summary { map: &args.map, cleared, peak_rss_bytes: memory::peak_bytes() };
        json::print(&summary, &mut out)?;
    } else {
        let Cleared { voxels_cleared, tiles_changed, tiles_removed, tiles, .. } = cleared;
        writeln!(
            out,
            "cleared   {} in {}",
            Counted(voxels_cleared, "voxel"),
            Counted(tiles_changed + tiles_removed, "tile")
        )?;
        writeln!(
            out,
            "tiles     {}; {} became empty and were removed",
            HumanCount(tiles),
            HumanCount(tiles_removed)
        )?;
    }
    Ok(ExitCode::SUCCESS)
}
