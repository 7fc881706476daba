//! Commands as functions, for programs that carry them: the same arguments, checks and answers, in the process of the
//! caller. Nothing is printed; standard input and output are used only where an argument is `-`.

use super::args::{BuildArgs, ExportArgs, ReadArgs};
use super::build::options_of;
use super::call_error::CallError;
use super::export as map_to_file;
use super::read_options::read_options;
use clap::error::{ContextKind, ContextValue};
use clap::{Args, Parser};
use serde_json::Value;
use std::ffi::OsString;
use std::path::Path;
use voxtile::Error;
use voxtile_formats::ScanSource;
use voxtile_pipeline::{Summary, Watch};

/// The arguments of one command, without its name.
#[derive(Debug, Parser)]
#[command(no_binary_name = true, disable_help_flag = true, allow_negative_numbers = true)]
struct Arguments<A: Args> {
    #[command(flatten)]
    of_command: A,
}

/// `voxtile build` with these arguments; returns what it prints with `--json`.
///
/// Where it is stopped, the map has what was accepted, and the answer says `interrupted`.
///
/// # Errors
///
/// What the command fails for; [`Error::Stopped`] before the first scan.
pub fn build(arguments: Vec<OsString>, watch: &Watch) -> Result<Value, CallError> {
    told(voxtile_pipeline::build(&options_of(&parse::<BuildArgs>(arguments)?)?, watch)?)
}

/// The same for a map that is to become a piece of another one, whose id it gets. It is not durable: whoever crashes
/// makes it again, and [`operations::move_piece`](voxtile::operations::move_piece()) makes it durable.
///
/// # Errors
///
/// As for [`build`].
pub fn build_piece(arguments: Vec<OsString>, piece_of: [u8; 16], watch: &Watch) -> Result<Value, CallError> {
    let mut options = options_of(&parse::<BuildArgs>(arguments)?)?;
    options.piece_of = Some(piece_of);
    told(voxtile_pipeline::build(&options, watch)?)
}

/// `voxtile export` with these arguments; returns what it prints with `--json`. Where it is stopped, nothing is
/// written.
///
/// # Errors
///
/// What the command fails for; [`Error::Stopped`].
pub fn export(arguments: Vec<OsString>, watch: &Watch) -> Result<Value, CallError> {
    Ok(map_to_file::export(&parse::<ExportArgs>(arguments)?, watch)?.json)
}

/// Opens scans as `voxtile build` does, with the options that its help lists under "Input".
///
/// # Errors
///
/// Arguments that make no sense, and an input that cannot be read.
pub fn open_scans(scans: &Path, arguments: Vec<OsString>) -> Result<Box<dyn ScanSource + Send>, CallError> {
    let options = read_options(&parse::<ReadArgs>(arguments)?)?;
    Ok(voxtile_pipeline::open_scans(scans, &options, &Watch::nobody())?)
}

fn told(summary: Option<Summary>) -> Result<Value, CallError> {
    Ok(serde_json::to_value(summary.ok_or(Error::Stopped)?).map_err(anyhow::Error::from)?)
}

fn parse<A: Args>(arguments: Vec<OsString>) -> voxtile::Result<A> {
    let parsed = Arguments::try_parse_from(arguments).map_err(|error| refused(&error))?;
    Ok(parsed.of_command)
}

/// What the parser says of its first finding, without the usage of a command line.
fn refused(error: &clap::Error) -> Error {
    let argument = match error.get(ContextKind::InvalidArg) {
        Some(ContextValue::String(argument)) => argument.split([' ', '=']).next().unwrap_or_default(),
        Some(ContextValue::Strings(arguments)) => arguments.first().map_or("", |argument| argument),
        _ => "",
    };
    let text = error.to_string();
    let reason = text.split("\n\n").next().unwrap_or_default().trim_start_matches("error: ");
    Error::argument(if argument.is_empty() { "arguments" } else { argument }, reason.trim_end())
}
