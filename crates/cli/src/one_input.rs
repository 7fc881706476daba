//! A shell makes many arguments of `drive_*.bag`; an input is one.

use clap::error::{ContextKind, ContextValue, Error, ErrorKind};
use std::path::Path;

/// An error of the command line, with what to do about several files where one input belongs.
pub fn explained(mut error: Error) -> Error {
    let is_file = match error.get(ContextKind::InvalidArg) {
        Some(ContextValue::String(argument)) => Path::new(argument).exists(),
        _ => false,
    };
    if error.kind() == ErrorKind::UnknownArgument && is_file {
        let tip = "an input is one file or folder: give the folder that holds the files, such as the parts of a bag";
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    }
    error
}
