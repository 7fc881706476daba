//! Hint for arguments such as `drive_*.bag`: the shell expands them to several files, but a command takes one input.

use clap::error::{ContextKind, ContextValue, Error, ErrorKind};
use std::path::Path;

/// Adds a hint to a command-line error about several files given as one input.
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
