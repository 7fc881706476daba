//! Commands as functions, for programs that carry them: the same arguments, checks and answers, in the process of the
//! caller. Nothing is printed; standard input and output are used only where an argument is `-`.

use super::args::ExportArgs;
use super::export;
use clap::error::{ContextKind, ContextValue};
use clap::{Args, Parser};
use serde_json::Value;
use std::ffi::OsString;
use voxtile::Error;
use voxtile_pipeline::Watch;

/// The arguments of one command, without its name.
#[derive(Debug, Parser)]
#[command(no_binary_name = true, disable_help_flag = true, allow_negative_numbers = true)]
struct Arguments<A: Args> {
    #[command(flatten)]
    of_command: A,
}

/// `voxtile export` with these arguments; returns what it prints with `--json`. Where it is stopped, nothing is
/// written.
///
/// # Errors
///
/// What the command fails for; [`Error::Stopped`].
pub fn export(arguments: Vec<OsString>, watch: &Watch) -> anyhow::Result<Value> {
    let args = parse::<ExportArgs>(arguments)?;
    Ok(match &args.scans {
        Some(folder) => serde_json::to_value(voxtile_pipeline::export_scans(&args.map, folder, watch)?),
        None => serde_json::to_value(voxtile_pipeline::export(&export::options_of(&args)?, watch)?),
    }?)
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
