//! What the commands share that map a part of a map again.

use crate::args::ReworkArgs;
use crate::build::memory_of;
use crate::progress::Progress;
use crate::run::{INTERRUPTED, say};
use crate::stop_signal;
use indicatif::HumanCount;
use std::io::Write;
use std::process::ExitCode;
use voxtile::operations::{Replay, Replayed};
use voxtile::scan::Stop;

/// How a map is mapped again, and its progress.
pub struct Job {
    pub rework: Replay,
    pub progress: Progress,
    stop: Stop,
}

impl Job {
    pub fn of(args: &ReworkArgs) -> anyhow::Result<Self> {
        let stop = stop_signal::catch_undone()?;
        let rework = Replay::default()
            .with_memory(memory_of(args.memory))
            .with_keep_as(args.keep_as.clone())
            .with_dry_run(args.dry_run)
            .with_stop(stop.clone());
        Ok(Self { rework, progress: Progress::over_scans(Some(0)), stop })
    }

    /// What a request to stop leads to: the map is as it was.
    pub fn ended<T>(&self, outcome: voxtile::Result<T>) -> anyhow::Result<Result<T, ExitCode>> {
        match outcome {
            Err(voxtile::Error::Stopped) if self.stop.is_set() => {
                say(format_args!("stopped; the map is as it was"));
                Ok(Err(ExitCode::from(INTERRUPTED)))
            }
            outcome => Ok(Ok(outcome?)),
        }
    }
}

/// Two lines for people.
pub fn print(mapped: &Replayed, is_dry_run: bool, out: &mut impl Write) -> std::io::Result<()> {
    let Replayed { scans, scans_changed, scans_mapped, tiles, tiles_mapped, updates, updates_mapped, .. } =
        *mapped;
    let would = if is_dry_run { "would be " } else { "" };
    let share = 100.0 * updates_mapped as f64 / updates.max(1) as f64;
    writeln!(
        out,
        "scans     {} of {}: {scans_changed} changed, {would}mapped again where that touches them",
        HumanCount(scans_mapped),
        HumanCount(scans)
    )?;
    writeln!(
        out,
        "tiles     {} of {} {would}mapped again, by {share:.1} % of the voxel updates of all scans",
        HumanCount(tiles_mapped),
        HumanCount(tiles)
    )?;
    match mapped.estimated_s {
        Some(seconds) => writeln!(out, "time      about {seconds:.1} s"),
        None => Ok(()),
    }
}
