//! What a program prints when it is done.

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use std::process::Command;

/// Runs a program and parses the one line of JSON that it prints.
///
/// # Errors
///
/// A program that cannot be started or fails, or prints anything else.
pub fn json_of(command: &mut Command) -> Result<Value> {
    let output = command.output().with_context(|| format!("{command:?}: cannot start it"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{} ({}; {command:?})", said.trim(), output.status);
    serde_json::from_slice(&output.stdout)
        .with_context(|| format!("{command:?}: printed something else than one line of JSON"))
}

/// A number in JSON.
///
/// # Errors
///
/// There is none.
pub fn number(json: &Value, pointer: &str) -> Result<f64> {
    json.pointer(pointer).and_then(Value::as_f64).with_context(|| format!("{pointer}: no number in {json}"))
}
