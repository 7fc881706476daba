//! What a program prints when it is done.

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use std::process::Command;

/// Runs a program to its end and reads the JSON that it prints, a line each. What it says beside is shown if it fails.
///
/// # Errors
///
/// A program that cannot be started, that fails, or prints something else.
pub fn json_lines_of(command: &mut Command) -> Result<Vec<Value>> {
    let output = command.output().with_context(|| format!("{command:?}: cannot start it"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{} ({}; {command:?})", said.trim(), output.status);
    let lines = String::from_utf8_lossy(&output.stdout);
    let values = lines.lines().map(serde_json::from_str).collect::<Result<_, _>>();
    values.with_context(|| format!("{command:?}: printed something else than JSON"))
}

/// The one line of JSON that a program prints; errors as for [`json_lines_of`].
///
/// # Errors
///
/// More lines than one, or none.
pub fn json_of(command: &mut Command) -> Result<Value> {
    let mut lines = json_lines_of(command)?;
    ensure!(lines.len() == 1, "{command:?}: {} lines instead of one", lines.len());
    Ok(lines.remove(0))
}

/// A number in JSON.
///
/// # Errors
///
/// There is none.
pub fn number(json: &Value, pointer: &str) -> Result<f64> {
    json.pointer(pointer).and_then(Value::as_f64).with_context(|| format!("{pointer}: no number in {json}"))
}
