//! Output of the measured programs.

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use std::process::Command;

/// Runs a program and parses its output, one line of JSON.
///
/// # Errors
///
/// Fails if the program cannot be started, fails or prints anything else.
pub fn json_of(command: &mut Command) -> Result<Value> {
    let output = command.output().with_context(|| format!("{command:?}: cannot start"))?;
    let errors = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{} ({}; {command:?})", errors.trim(), output.status);
    serde_json::from_slice(&output.stdout)
        .with_context(|| format!("{command:?}: the output is not one line of JSON"))
}

/// Reads a number from JSON.
///
/// # Errors
///
/// Fails if the number is missing.
pub fn number(json: &Value, pointer: &str) -> Result<f64> {
    json.pointer(pointer).and_then(Value::as_f64).with_context(|| format!("{pointer}: no number in {json}"))
}
