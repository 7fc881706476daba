//! Runs a command line and returns its exit code.

use super::args::{Cli, Command};
use super::failure::JsonTo;
#[cfg(feature = "view")]
use super::view;
use super::{
    build, clean, clear, compare, completions, convert, coverage, crop, decay, demo, diff, digest, distance,
    export, import, info, local, logging, man, merge, option_names, picture, query, quiet, raycast, remap,
    remove_points, remove_scans, repair, report, revert, scans, share, snapshot, snapshots, threads, verify,
    volume,
};
#[cfg(feature = "bucket")]
use super::{pull, push};
use clap::{CommandFactory as _, FromArgMatches as _};
use std::ffi::OsString;
use std::process::ExitCode;
use voxtile::begin_with_one_heap;
#[cfg(feature = "bucket")]
use voxtile_pipeline::place;

/// Runs the command with the arguments of this process.
pub fn main() -> ExitCode {
    run(std::env::args_os())
}

/// Runs the command with `arguments`, the program's name first. Exits the process for invalid arguments and for help.
/// Requires a process of its own, because it sets up logging, threads and signal handlers.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let matches = Cli::command().try_get_matches_from(with_plain_numbers(arguments));
    let matches = matches.unwrap_or_else(|error| error.exit());
    option_names::name_options_of(matches.subcommand_name().unwrap_or_default());
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    logging::begin(&cli);
    #[cfg(feature = "bucket")]
    if let Some(timeout) = cli.bucket_timeout {
        place::set_bucket_timeout(timeout);
    }
    let Cli { command, threads, quiet, .. } = cli;
    let json_to = JsonTo::of(&command);
    if quiet {
        quiet::be_quiet();
    }
    if keeps_to_bytes(&command) {
        // Must precede the start of other threads and the first read of standard input.
        begin_with_one_heap();
    }
    if is_parallel(&command)
        && let Err(error) = threads::start(threads)
    {
        return json_to.report(&error);
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
        Command::Distance(args) => distance::run(&args),
        Command::Digest(args) => digest::run(&args),
        Command::Snapshot(args) => snapshot::run(&args),
        Command::Snapshots(args) => snapshots::run(&args),
        Command::Diff(args) => diff::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Coverage(args) => coverage::run(&args),
        Command::Volume(args) => volume::run(&args),
        Command::Revert(args) => revert::run(&args),
        Command::Merge(args) => merge::run(&args),
        Command::Crop(args) => crop::run(&args),
        Command::Clear(args) => clear::run(&args),
        Command::Decay(args) => decay::run(&args),
        Command::Convert(args) => convert::run(&args),
        Command::Remap(args) => remap::run(&args),
        Command::RemoveScans(args) => remove_scans::run(&args),
        Command::RemovePoints(args) => remove_points::run(&args),
        Command::Clean(args) => clean::run(&args),
        #[cfg(feature = "bucket")]
        Command::Push(args) => push::run(&args),
        #[cfg(feature = "bucket")]
        Command::Pull(args) => pull::run(&args),
        #[cfg(not(feature = "bucket"))]
        Command::Push(_) => Err(left_out("push", "bucket")),
        #[cfg(not(feature = "bucket"))]
        Command::Pull(_) => Err(left_out("pull", "bucket")),
        Command::Verify(args) => verify::run(&args),
        Command::Repair(args) => repair::run(&args),
        #[cfg(feature = "view")]
        Command::View(args) => view::run(&args),
        #[cfg(not(feature = "view"))]
        Command::View(_) => Err(left_out("view", "view")),
        Command::Local(args) => local::run(&args),
        Command::Share(args) => share::run(&args),
        Command::Demo(args) => demo::run(&args),
        Command::Completions(args) => completions::run(&args),
        Command::Man(args) => man::run(&args),
    };
    outcome.unwrap_or_else(|error| json_to.report(&error))
}

/// Returns the error for a subcommand that is not in this build.
#[cfg(not(all(feature = "bucket", feature = "view")))]
fn left_out(subcommand: &str, feature: &str) -> anyhow::Error {
    let reason = format!(
        "this voxtile was built without the feature `{feature}`; `cargo install --locked --path crates/cli --features \
         {feature}` installs one with it"
    );
    voxtile::Error::argument(subcommand, reason).into()
}

/// Rewrites negative numbers such as `-1e-05`, `-.5` and `-inf`, which clap would parse as options.
fn with_plain_numbers(arguments: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut are_options_over = false;
    let plain = |argument: OsString| {
        are_options_over |= argument == "--";
        match argument.to_str().filter(|_| !are_options_over).and_then(plain_number) {
            Some(plain) => plain.into(),
            None => argument,
        }
    };
    arguments.into_iter().map(plain).collect()
}

/// Rewrites a negative number in plain digits; `None` if the text needs no rewriting.
fn plain_number(text: &str) -> Option<String> {
    let digits = text.strip_prefix('-')?;
    if digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    match text.parse::<f64>().ok()? {
        f64::NEG_INFINITY => Some("-1e999".to_owned()),
        number => Some(number.to_string()),
    }
}

/// Returns whether the command maps within a memory budget in bytes.
const fn keeps_to_bytes(command: &Command) -> bool {
    match command {
        Command::Build(args) => args.cache_tiles.is_none(),
        Command::Remap(_) | Command::RemoveScans(_) | Command::RemovePoints(_) | Command::Clean(_) => true,
        _ => false,
    }
}

/// Returns whether the command uses several threads.
fn is_parallel(command: &Command) -> bool {
    match command {
        Command::Build(_)
        | Command::Remap(_)
        | Command::RemoveScans(_)
        | Command::RemovePoints(_)
        | Command::Clean(_)
        | Command::Compare(_)
        | Command::Coverage(_)
        | Command::Volume(_)
        | Command::Local(_)
        | Command::Demo(_)
        | Command::Distance(_)
        | Command::Export(_)
        | Command::Info(_)
        | Command::Picture(_)
        | Command::Report(_)
        | Command::View(_) => true,
        Command::Scans(_)
        | Command::Import(_)
        | Command::Query(_)
        | Command::Raycast(_)
        | Command::Digest(_)
        | Command::Snapshot(_)
        | Command::Snapshots(_)
        | Command::Diff(_)
        | Command::Revert(_)
        | Command::Merge(_)
        | Command::Crop(_)
        | Command::Clear(_)
        | Command::Decay(_)
        | Command::Convert(_)
        | Command::Push(_)
        | Command::Pull(_)
        | Command::Verify(_)
        | Command::Repair(_)
        | Command::Share(_)
        | Command::Completions(_)
        | Command::Man(_) => false,
    }
}

/// Exit code after Ctrl-C or SIGTERM; all scans so far were flushed.
pub const INTERRUPTED: u8 = 130;
