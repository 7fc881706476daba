//! The command `voxtile` of the wheel.

use pyo3::prelude::*;
use std::ffi::OsString;
use std::process::ExitCode;

/// Runs the command with `arguments`, the first of which is the program's name. Ends the process with its exit code.
#[pyfunction]
pub fn run_command(py: Python<'_>, arguments: Vec<OsString>) {
    py.detach(|| {
        let code = voxtile_cli::run(arguments);
        // `ExitCode` does not expose its number, so compare it with every number.
        let failed = (1..=u8::MAX).find(|&number| ExitCode::from(number) == code);
        std::process::exit(failed.map_or(0, i32::from))
    })
}
