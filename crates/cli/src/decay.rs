use crate::args::DecayArgs;
use crate::counted::Counted;
use crate::json;
use crate::progress::Progress;
use crate::quiet::summary_out;
use indicatif::HumanCount;
use serde::Serialize;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;
use voxtile::Error;
use voxtile::operations::{Decay, Decayed, Forgotten, MaxAge, decay, forget_old};
use voxtile_pipeline::memory;
use voxtile_pipeline::whole_map;

#[derive(Serialize)]
struct Summary<'a, T> {
    #[serde(serialize_with = "voxtile::path_text::serialize")]
    map: &'a Path,
    #[serde(flatten)]
    result: T,
    peak_rss_bytes: Option<u64>,
}

pub fn run(args: &DecayArgs) -> anyhow::Result<ExitCode> {
    match (args.older_than, args.halflife) {
        (Some(age), _) => run_forget(args, age),
        (None, Some(halflife)) => run_decay(args, halflife),
        (None, None) => Err(Error::argument("halflife", "is missing; or use `older_than`").into()),
    }
}

fn run_decay(args: &DecayArgs, halflife: f64) -> anyhow::Result<ExitCode> {
    let mut rule = Decay::new(halflife).with_forget_below(args.forget_below.unwrap_or(0.0));
    rule.scans = args.scans;
    let progress = Progress::over_tiles(0);
    let decayed = decay(whole_map(&args.map)?, &rule, |done, all| progress.set(done, all))?;
    drop(progress);
    let mut out = summary_out(args.json);
    if args.json {
        json::print(&Summary::of(args, decayed), &mut out)?;
    } else {
        let Decayed { scans, factor, voxels, voxels_forgotten, tiles, tiles_removed, .. } = decayed;
        writeln!(out, "decayed   by {}: log-odds times {factor:.6}", Counted(scans, "scan"))?;
        if scans == 0 {
            writeln!(out, "          no scans since the last decay; --scans N sets the number")?;
        }
        print_counts([voxels, voxels_forgotten, tiles, tiles_removed], &mut out)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn run_forget(args: &DecayArgs, age: Duration) -> anyhow::Result<ExitCode> {
    let mut rule = MaxAge::new(age);
    if let Some(now_s) = args.now {
        let now_ns = (now_s * 1e9).round();
        if !(now_ns >= i64::MIN as f64 && now_ns < i64::MAX as f64) {
            return Err(Error::argument("now", format!("{now_s} is not a time in seconds")).into());
        }
        rule = rule.with_now(now_ns as i64);
    }
    let progress = Progress::over_tiles(0);
    let forgotten = forget_old(whole_map(&args.map)?, &rule, |done, all| progress.set(done, all))?;
    drop(progress);
    let mut out = summary_out(args.json);
    if args.json {
        json::print(&Summary::of(args, forgotten), &mut out)?;
    } else {
        let Forgotten { oldest_ns, voxels, voxels_forgotten, tiles, tiles_removed, .. } = forgotten;
        if let Some(oldest_ns) = oldest_ns {
            let (age, oldest_s) = (humantime::format_duration(age), oldest_ns as f64 / 1e9);
            writeln!(out, "forgotten older than {age}: last hit before {oldest_s:.3} s")?;
        }
        print_counts([voxels, voxels_forgotten, tiles, tiles_removed], &mut out)?;
        if forgotten.voxels_without_time > 0 {
            let count = Counted(forgotten.voxels_without_time, "occupied voxel");
            writeln!(out, "          {count} without a time remain")?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

impl<'a, T> Summary<'a, T> {
    fn of(args: &'a DecayArgs, result: T) -> Self {
        Self { map: &args.map, result, peak_rss_bytes: memory::peak_bytes() }
    }
}

fn print_counts([voxels, forgotten, tiles, removed]: [u64; 4], out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "voxels    {}; {} forgotten", HumanCount(voxels), HumanCount(forgotten))?;
    writeln!(out, "tiles     {}; {} became empty and were removed", HumanCount(tiles), HumanCount(removed))
}
