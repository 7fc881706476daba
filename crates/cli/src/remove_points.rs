use crate::args::RemovePointsArgs;
use crate::counted::Counted;
use crate::json;
use crate::part::region_of;
use crate::quiet::summary_out;
use crate::replay::{self, Job};
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;
use voxtile::operations::{PointsRemoved, remove_points};
use voxtile_pipeline::memory;
use voxtile_pipeline::whole_map;

#[derive(Serialize)]
struct Summary<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    dry_run: bool,
    kept_as: Option<&'a str>,
    #[serde(flatten)]
    removed: PointsRemoved,
    seconds: f64,
    peak_rss_bytes: Option<u64>,
}

pub fn run(args: &RemovePointsArgs) -> anyhow::Result<ExitCode> {
    let map = whole_map(&args.map)?;
    let started = Instant::now();
    let (job, region) = (Job::of(&args.replay)?, region_of(&args.region)?);
    let outcome = remove_points(map, &region, &job.replay, |done, all| job.progress.set(done, all));
    let removed = match job.ended(outcome)? {
        Ok(removed) => removed,
        Err(code) => return Ok(code),
    };
    drop(job);
    let mut out = summary_out(args.replay.json || args.replay.dry_run);
    if args.replay.json {
        let summary = Summary {
            map,
            dry_run: args.replay.dry_run,
            kept_as: args.replay.keep_as.as_ref().map(|name| name.as_str()),
            removed,
            seconds: started.elapsed().as_secs_f64(),
            peak_rss_bytes: memory::peak_bytes(),
        };
        json::print(&summary, &mut out)?;
        return Ok(ExitCode::SUCCESS);
    }
    let would = if args.replay.dry_run { "would be " } else { "" };
    let PointsRemoved { mapped, points_removed, .. } = removed;
    let (points, scans) = (Counted(points_removed, "point"), Counted(mapped.scans_changed, "scan"));
    writeln!(out, "removed   {points} of {scans} {would}removed")?;
    replay::print(&mapped, args.replay.dry_run, &mut out)?;
    Ok(ExitCode::SUCCESS)
}
