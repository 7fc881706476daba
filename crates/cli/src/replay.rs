//! Shared code of the commands that replay kept scans.

use crate::args::ReplayArgs;
use crate::build::memory_of;
use crate::logging::print_message;
use crate::progress::Progress;
use crate::run::INTERRUPTED;
use crate::stop_signal;
use indicatif::HumanCount;
use std::io::Write;
use std::process::ExitCode;
use voxtile::operations::{Replay, Replayed};
use voxtile::scan::Stop;

/// A replay with its progress bar.
pub struct Job {
    pub replay: Replay,
    pub progress: Progress,
    stop: Stop,
}

impl Job {
    pub fn of(args: &ReplayArgs) -> anyhow::Result<Self> {
        let stop = stop_signal::catch_undone()?;
        let replay = Replay::default()
            .with_memory(memory_of(args.memory))
            .with_keep_as(args.keep_as.clone())
            .with_dry_run(args.dry_run)
            .with_stop(stop.clone());
        Ok(Self { replay, progress: Progress::over_scans(Some(0)), stop })
    }

    /// Returns the exit code if a signal stopped the replay, after a message that the map has not changed.
    pub fn ended<T>(&self, outcome: voxtile::Result<T>) -> anyhow::Result<Result<T, ExitCode>> {
        match outcome {
            Err(voxtile::Error::Stopped) if self.stop.is_set() => {
                print_message(format_args!("stopped; the map has not changed"));
                Ok(Err(ExitCode::from(INTERRUPTED)))
            }
            outcome => Ok(Ok(outcome?)),
        }
    }
}

/// Prints how many scans and tiles were or would be replayed, and the expected time of a dry run.
pub fn print(mapped: &Replayed, is_dry_run: bool, out: &mut impl Write) -> std::io::Result<()> {
    let Replayed { scans, scans_changed, scans_mapped, tiles, tiles_mapped, updates, updates_mapped, .. } =
        *mapped;
    let would = if is_dry_run { "would be " } else { "" };
    let share = 100.0 * updates_mapped as f64 / updates.max(1) as f64;
    writeln!(
        out,
        "scans     {} of {} {would}replayed; {scans_changed} changed",
        HumanCount(scans_mapped),
        HumanCount(scans)
    )?;
    writeln!(
        out,
        "tiles     {} of {} {would}rebuilt, with {share:.1} % of the voxel updates of all scans",
        HumanCount(tiles_mapped),
        HumanCount(tiles)
    )?;
    match mapped.estimated_s {
        Some(seconds) => writeln!(out, "time      about {seconds:.1} s"),
        None => Ok(()),
    }
}
