use crate::args::CleanArgs;
use crate::counted::Counted;
use crate::json;
use crate::part::region_of;
use crate::quiet::summary_out;
use crate::replay::{self, Job};
use crate::stop_signal;
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

/// State of a map with earlier marks after a run that did not end.
const ONLY_UNMARKED: &str =
    "the earlier marks are removed, and no point has got a new one; run the command again";

pub fn run(args: &CleanArgs) -> anyhow::Result<ExitCode> {
    let map = whole_map(&args.map)?;
    let started = Instant::now();
    let stop = if args.undo { stop_signal::catch_undone()? } else { stop_signal::catch_unmarked()? };
    let job = Job::with_stop(&args.replay, stop);
    let region = args.region.as_deref().map(region_of).transpose()?;
    // Earlier marks are removed by a commit of their own, before the search.
    let (mut had_marks, mut are_removed) = (false, false);
    let progress = |phase, done, all| {
        had_marks |= phase == Phase::Undoing;
        are_removed |= had_marks && phase != Phase::Undoing;
        job.progress.set(done, all);
        job.progress.show_message(match phase {
            Phase::Undoing => "removing earlier marks",
            Phase::Mapping => "mapping in reverse order",
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
    are_removed &= !args.undo;
    let state = if are_removed { ONLY_UNMARKED } else { "the map has not changed" };
    let outcome = match job.ended_with(outcome, state) {
        Err(error) if are_removed => return Err(error.context(ONLY_UNMARKED)),
        outcome => outcome?,
    };
    let cleaned = match outcome {
        Ok(cleaned) => cleaned,
        Err(code) => return Ok(code),
    };
    drop(job);
    let has_commit = !args.replay.dry_run && (are_removed || cleaned.replayed.scans_changed > 0);
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
    let (points, scans) = (Counted(points, "point"), Counted(replayed.scans_changed, "scan"));
    let what = if args.undo { "no longer marked" } else { "marked" };
    writeln!(out, "moving    {points_changed} of {points} {would}{what}, in {scans}")?;
    replay::print(&replayed, args.replay.dry_run, &mut out)?;
    Ok(ExitCode::SUCCESS)
}
