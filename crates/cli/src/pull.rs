use crate::args::PullArgs;
use crate::json;
use crate::progress::Progress;
use crate::quiet::summary_out;
use indicatif::{HumanBytes, HumanCount};
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use voxtile_bucket::{Pulled, pull};
use voxtile_pipeline::memory;
use voxtile_pipeline::place::{bucket_at, check_is_folder};

#[derive(Serialize)]
struct Summary<'a> {
    url: &'a str,
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    #[serde(flatten)]
    pulled: Pulled,
    peak_rss_bytes: Option<u64>,
}

pub fn run(args: &PullArgs) -> anyhow::Result<ExitCode> {
    check_is_folder(&args.map)?;
    let bucket = bucket_at(&args.url)?;
    let progress = Progress::over_bytes();
    let pulled = pull(&bucket, &args.map, args.replace, |done, all| progress.set(done, all))?;
    drop(progress);
    let mut out = summary_out(args.json);
    if args.json {
        let peak_rss_bytes = memory::peak_bytes();
        let summary = Summary { url: bucket.url(), map: &args.map, pulled, peak_rss_bytes };
        json::print(&summary, &mut out)?;
        return Ok(ExitCode::SUCCESS);
    }
    let Pulled { flush_number, tiles, files, files_fetched, bytes_fetched, bytes } = pulled;
    writeln!(out, "pulled    flush {flush_number}, {} tiles, to {}", HumanCount(tiles), args.map.display())?;
    writeln!(
        out,
        "fetched   {} of {} files, {} of {}",
        HumanCount(files_fetched),
        HumanCount(files),
        HumanBytes(bytes_fetched),
        HumanBytes(bytes)
    )?;
    Ok(ExitCode::SUCCESS)
}
