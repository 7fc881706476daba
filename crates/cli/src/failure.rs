use crate::args::Command;
use crate::json;
use crate::logging::{print_error, print_message};
use crate::option_names::{option_of, with_options};
use crate::run::INTERRUPTED;
use serde::Serialize;
use std::io;
use std::process::ExitCode;
use voxtile::{Error, Place};
use voxtile_pipeline::output::is_standard_output;

/// Destination of the JSON object for an error, in addition to the text on standard error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JsonTo {
    /// No JSON was requested.
    Nowhere,
    /// Standard output, in place of the result.
    Output,
    /// Standard error, because standard output is the output file.
    Error,
}

/// JSON object of an error, without fields that do not apply.
#[derive(Serialize)]
struct Failure<'a> {
    kind: &'a str,
    message: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    argument: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    path: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tile: Option<[i32; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    offset: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    line: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    record: Option<u64>,
}

impl JsonTo {
    /// Returns the destination for a command line.
    pub fn of(command: &Command) -> Self {
        match command {
            Command::Export(args)
                if args.json && args.scans.is_none() && is_standard_output(&args.output) =>
            {
                Self::Error
            }
            Command::Picture(args) if args.json && is_standard_output(&args.output) => Self::Error,
            Command::Report(args) if args.json && is_standard_output(&args.output) => Self::Error,
            command => Self::output_if(command.is_json()),
        }
    }

    /// Returns standard output if JSON is requested.
    pub fn output_if(json: bool) -> Self {
        if json { Self::Output } else { Self::Nowhere }
    }

    /// Reports an error and returns its exit code.
    pub fn report(self, error: &anyhow::Error) -> ExitCode {
        if is_closed_pipe(error) {
            return ExitCode::SUCCESS;
        }
        let message = message_of(error);
        print_error(format_args!("{message}"));
        let known = error.downcast_ref::<Error>();
        self.print(&Failure::of(known, &message));
        exit_code_of(known)
    }

    /// Reports a stop before the command has a result.
    pub fn report_stopped(self, message: &str) {
        print_message(format_args!("{message}"));
        self.print(&Failure::of(Some(&Error::Stopped), message));
    }

    fn print(self, failure: &Failure) {
        let object = serde_json::json!({ "error": failure });
        // A failed write cannot be reported.
        let _ = match self {
            Self::Nowhere => Ok(()),
            Self::Output => json::print(&object, &mut io::stdout().lock()),
            Self::Error => json::print(&object, &mut io::stderr().lock()),
        };
    }
}

impl<'a> Failure<'a> {
    fn of(error: Option<&'a Error>, message: &'a str) -> Self {
        let place = error.and_then(Error::place);
        let at = |wanted| place.filter(|&(place, _)| place == wanted).map(|(_, at)| at);
        Self {
            kind: error.map_or("other", Error::kind),
            message,
            argument: match error {
                Some(Error::InvalidArgument { argument, .. }) => Some(option_of(argument)),
                _ => None,
            },
            path: error.and_then(Error::path).map(|path| path.display().to_string()),
            tile: error.and_then(Error::tile).map(|tile| tile.to_array()),
            offset: at(Place::Offset),
            line: at(Place::Line),
            record: at(Place::Record),
        }
    }
}

/// Returns the error with its causes and with options in place of field names. An I/O error without context is about
/// standard output: errors of files and programs have their name as context.
pub fn message_of(error: &anyhow::Error) -> String {
    if let Some(error) = error.chain().next().and_then(|first| first.downcast_ref::<io::Error>()) {
        return format!("standard output: cannot write: {error}");
    }
    let causes = error.chain().map(|cause| match cause.downcast_ref::<Error>() {
        Some(Error::InvalidArgument { argument, reason }) => {
            format!("{}: {}", option_of(argument), with_options(reason))
        }
        _ => with_options(&cause.to_string()).into_owned(),
    });
    causes.collect::<Vec<_>>().join(": ")
}

/// Returns 2 for errors that the user can fix on the command line, 1 for all others.
fn exit_code_of(error: Option<&Error>) -> ExitCode {
    match error {
        Some(
            Error::InvalidArgument { .. }
            | Error::Grid(_)
            | Error::AlreadyExists { .. }
            | Error::Mismatch { .. },
        ) => ExitCode::from(2),
        Some(Error::Stopped) => ExitCode::from(INTERRUPTED),
        _ => ExitCode::FAILURE,
    }
}

/// Returns whether the reader of standard output is gone, as in `voxtile ... | head`. A broken pipe inside an [`Error`]
/// belongs to another file and does not count.
fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .take_while(|cause| !cause.is::<Error>())
        .filter_map(|cause| cause.downcast_ref::<io::Error>())
        .any(|cause| cause.kind() == io::ErrorKind::BrokenPipe)
}
