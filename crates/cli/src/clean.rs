use crate::args::CleanArgs;
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
use voxtile_clean::{Clean, Cleaned, Phase, clean, undo};
use voxtile_pipeline::memory;
use voxtile_pipeline::whole_map;

#[derive(Serialize)]
struct Summary<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    dry_run: bool,
    undo: bool,
    kept_as: Option<&'a str>,
    #[serde(flatten)]
    cleaned: Cleaned,
    seconds: f64,
    peak_rss_bytes: Option<u64>,
}

pub fn run(args: &CleanArgs) -> anyhow::Result<ExitCode> {
    let map = whole_map(&args.map)?;
    let started = Instant::now();
    let job = Job::of(&args.replay)?;
    let region = args.region.as_deref().map(region_of).transpose()?;
    let progress = |phase, done, all| {
        job.progress.set(done, all);
        job.progress.show_message(match phase {
            Phase::Undoing => "removing marks",
            Phase::Mapping => "mapping",
            Phase::Counting => "counting hits",
            Phase::Finding => "finding what moved",
            Phase::Replaying => "replaying",
            _ => "",
        });
    };
    let options = Clean::new(job.replay.clone()).with_region(region).with_parked_scans(args.parked_scans);
    let outcome = match args.undo {
        true => undo(map, &job.replay, progress),
        false => clean(map, &options, progress),
    };
    let cleaned = match job.ended(outcome)? {
        Ok(cleaned) => cleaned,
        Err(code) => return Ok(code),
    };
    drop(job);
    let has_commit = !args.replay.dry_run && cleaned.replayed.scans_changed > 0;
    let mut out = summary_out(args.replay.json || args.replay.dry_run);
    if args.replay.json {
        let summary = Summary {
            map,
            dry_run: args.replay.dry_run,
            undo: args.undo,
            kept_as: args.replay.keep_as.as_ref().filter(|_| has_commit).map(|name| name.as_str()),
            cleaned,
            seconds: started.elapsed().as_secs_f64(),
            peak_rss_bytes: memory::peak_bytes(),
        };
        json::print(&summary, &mut out)?;
        return Ok(ExitCode::SUCCESS);
    }
    let would = if args.replay.dry_run { "would be " } else { "" };
    let Cleaned { replayed, points, points_changed, .. } = cleaned;
    let points = Counted(points, "point");
    let what = if args.undo { "no longer marked" } else { "marked" };
    writeln!(out, "moving    {points_changed} of {points} {would}{what}")?;
    replay::print(&replayed, args.replay.dry_run, &mut out)?;
    Ok(ExitCode::SUCCESS)
}
