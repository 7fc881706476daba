use crate::args::PushArgs;
use crate::json;
use crate::progress::Progress;
use crate::quiet::summary_out;
use indicatif::{HumanBytes, HumanCount};
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use voxtile_bucket::{PushOptions, Pushed, push};
use voxtile_pipeline::memory;
use voxtile_pipeline::place::bucket_at;
use voxtile_pipeline::whole_map;

#[derive(Serialize)]
struct Summary<'a> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    url: &'a str,
    #[serde(flatten)]
    pushed: Pushed,
    peak_rss_bytes: Option<u64>,
}

pub fn run(args: &PushArgs) -> anyhow::Result<ExitCode> {
    let bucket = bucket_at(&args.url)?;
    let progress = Progress::over_tiles(0);
    let options = PushOptions { prunes: args.prune, replaces: args.replace, resends: args.resend };
    let pushed = push(whole_map(&args.map)?, &bucket, options, |done, all| progress.set(done, all))?;
    drop(progress);
    let mut out = summary_out(args.json);
    if args.json {
        let peak_rss_bytes = memory::peak_bytes();
        let summary = Summary { map: &args.map, url: bucket.url(), pushed, peak_rss_bytes };
        json::print(&summary, &mut out)?;
        return Ok(ExitCode::SUCCESS);
    }
    let Pushed { flush_number, tiles, tiles_sent, objects_sent, bytes_sent, bytes, objects_pruned } = pushed;
    writeln!(out, "pushed    flush {flush_number} to {}", bucket.url())?;
    writeln!(
        out,
        "sent      {} of {} tiles: {} objects, {} of {}",
        HumanCount(tiles_sent),
        HumanCount(tiles),
        HumanCount(objects_sent),
        HumanBytes(bytes_sent),
        HumanBytes(bytes)
    )?;
    if args.prune {
        writeln!(out, "pruned    {} objects", HumanCount(objects_pruned))?;
    }
    Ok(ExitCode::SUCCESS)
}
