//! The command `voxtile`: parse, run one command, exit code.

mod args;
mod build;
mod build_config;
mod clear;
mod completions;
mod convert;
mod crop;
mod decay;
mod demo;
mod diff;
mod digest;
mod export;
mod export_3d_tiles;
mod export_origin;
mod export_voxels;
mod failure;
mod flush_schedule;
mod import;
mod info;
mod intake;
mod json;
mod local;
mod local_table;
mod man;
mod map_at;
mod memory;
mod merge;
mod octree_choice;
mod octree_file;
mod one_heap;
mod output_file;
mod part;
mod picture;
mod progress;
mod query;
mod raycast;
mod read_options;
mod repair;
mod report;
mod revert;
mod scan_input;
mod scan_reader;
mod scans;
mod share;
mod snapshot;
mod snapshots;
mod stop_signal;
mod summary;
mod terminal;
mod threads;
mod verify;
#[cfg(feature = "view")]
mod view;
mod written;

use args::{Cli, Command};
use clap::Parser;
use failure::JsonTo;
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = Cli::parse();
    // The command line before the environment, where it says something.
    let mut log = env_logger::Builder::new();
    log.filter_level(cli.log_level()).format_timestamp(None);
    if !cli.quiet && cli.verbose == 0 {
        log.parse_default_env();
    }
    log.init();
    let Cli { command, threads, quiet, .. } = cli;
    let json_to = JsonTo::of(&command);
    if quiet {
        progress::hide_all();
    }
    if let Command::Build(args) = &command
        && args.cache_tiles.is_none()
    {
        // Before there is a second thread, and before anything is read from standard input.
        one_heap::begin_with_one_heap();
    }
    if is_parallel(&command)
        && let Err(error) = threads::start(threads)
    {
        return json_to.tell(&error);
    }
    let outcome = match command {
        Command::Build(args) => build::run(&args),
        Command::Scans(args) => scans::run(&args),
        Command::Import(args) => import::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Query(args) => query::run(&args),
        Command::Raycast(args) => raycast::run(&args),
        Command::Export(args) => export::run(&args, quiet),
        Command::Picture(args) => picture::run(&args, quiet),
        Command::Report(args) => report::run(&args, quiet),
        Command::Digest(args) => digest::run(&args),
        Command::Snapshot(args) => snapshot::run(&args),
        Command::Snapshots(args) => snapshots::run(&args),
        Command::Diff(args) => diff::run(&args),
        Command::Revert(args) => revert::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::Crop(args) => crop::run(&args),
        Command::Clear(args) => clear::run(&args),
        Command::Decay(args) => decay::run(&args),
        Command::Convert(args) => convert::run(&args),
        Command::Verify(args) => verify::run(&args),
        Command::Repair(args) => repair::run(&args),
        #[cfg(feature = "view")]
        Command::View(args) => view::run(&args),
        Command::Local(args) => local::run(&args),
        Command::Share(args) => share::run(&args),
        Command::Demo(args) => demo::run(&args),
        Command::Completions(args) => completions::run(&args),
        Command::Man(args) => man::run(&args),
    };
    outcome.unwrap_or_else(|error| json_to.tell(&error))
}

/// Whether a command works on several threads.
fn is_parallel(command: &Command) -> bool {
    match command {
        Command::Build(_)
        | Command::Local(_)
        | Command::Demo(_)
        | Command::Picture(_)
        | Command::Report(_) => true,
        Command::Info(args) => info::may_draw(args),
        _ => false,
    }
}

/// One line for a person. Where standard error refuses it there is nobody to tell.
pub fn say(line: std::fmt::Arguments<'_>) {
    let _ = writeln!(std::io::stderr().lock(), "voxtile: {line}");
}

/// Ended by Ctrl-C or SIGTERM, after everything so far was flushed.
pub const INTERRUPTED: u8 = 130;
