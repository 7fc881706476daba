use crate::args::RemoveScansArgs;
use crate::counted::Counted;
use crate::json;
use crate::logging::print_message;
use crate::quiet::summary_out;
use crate::replay::{self, Job};
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;
use voxtile::Error;
use voxtile::operations::{ScanSelection, ScansRemoved, remove_scans};
use voxtile_pipeline::memory;
use voxtile_pipeline::whole_map;

#[derive(Serialize)]
struct Summary<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    dry_run: bool,
    kept_as: Option<&'a str>,
    #[serde(flatten)]
    removed: ScansRemoved,
    seconds: f64,
    peak_rss_bytes: Option<u64>,
}

pub fn run(args: &RemoveScansArgs) -> anyhow::Result<ExitCode> {
    let map = whole_map(&args.map)?;
    let started = Instant::now();
    let (job, scans) = (Job::of(&args.replay)?, selection_of(args)?);
    let progress = |done, all| job.progress.set(done, all);
    let outcome = remove_scans(map, &scans, args.from_snapshots, &job.replay, progress);
    let removed = match job.ended(outcome)? {
        Ok(removed) => removed,
        Err(code) => return Ok(code),
    };
    drop(job);
    let code = match &*removed.snapshots_failed {
        [] => ExitCode::SUCCESS,
        failed => {
            let names: Vec<_> = failed.iter().map(|failed| failed.name.as_str()).collect();
            let names = names.join(", ");
            print_message(format_args!(
                "{}: scans are removed from the map, but these snapshots may still contain some of them: {names}",
                map.display()
            ));
            ExitCode::FAILURE
        }
    };
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
        return Ok(code);
    }
    let would = if args.replay.dry_run { "would be " } else { "" };
    writeln!(out, "removed   {} {would}removed", Counted(removed.scans_removed, "scan"))?;
    if removed.files_removed > 0 {
        let files = Counted(removed.files_removed, "file");
        writeln!(out, "completed an earlier removal: deleted {files} with removed scans")?;
    }
    if removed.scans_removed > 0 {
        replay::print(&removed.mapped, args.replay.dry_run, &mut out)?;
    }
    for name in &removed.snapshots_deleted {
        writeln!(out, "snapshot  {name} contained some of them and is deleted")?;
    }
    for name in &removed.snapshots_with_them {
        writeln!(out, "snapshot  {name} still contains some of them; --from-snapshots deletes it")?;
    }
    for failed in &removed.snapshots_failed {
        writeln!(out, "snapshot  {} may contain some of them: {}", failed.name, failed.reason)?;
    }
    Ok(code)
}

fn selection_of(args: &RemoveScansArgs) -> voxtile::Result<ScanSelection> {
    if let Some(name) = &args.input {
        return Ok(ScanSelection::Input(name.clone()));
    }
    if let Some([first, last]) = args.time.as_deref() {
        return Ok(ScanSelection::Time(stamp_of(first)?, stamp_of(last)?));
    }
    let text = args.scans.as_deref().unwrap_or_default();
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    match (first.trim().parse(), last.trim().parse()) {
        (Ok(first), Ok(last)) if first <= last => Ok(ScanSelection::Numbers(first, last)),
        _ => Err(Error::argument("--scans", format!("{text:?} is not a range of numbers such as 120..180"))),
    }
}

/// Parses seconds to nanoseconds, exactly.
fn stamp_of(text: &str) -> voxtile::Result<i64> {
    let (whole, rest) = text.split_once('.').unwrap_or((text, ""));
    let is_number = !rest.starts_with(['-', '+']) && rest.len() <= 9;
    let digits = format!("{rest:0<9}");
    let whole_s: Option<i64> = whole.parse().ok();
    let rest_ns: Option<i64> = digits.parse().ok().filter(|_| is_number);
    let stamp = whole_s.zip(rest_ns).and_then(|(whole_s, rest_ns)| {
        let rest_ns = if whole.starts_with('-') { -rest_ns } else { rest_ns };
        whole_s.checked_mul(1_000_000_000)?.checked_add(rest_ns)
    });
    stamp.ok_or_else(|| Error::argument("--time", format!("{text:?} is not a time in seconds")))
}
