//! Output of `--json`: one object per line, with the version of its fields.

use serde::Serialize;
use std::io::Write;

/// Incremented when a field is removed or changes its meaning; see docs/json.md.
const VERSION: u32 = 1;

#[derive(Serialize)]
struct Versioned<'a, T> {
    version: u32,
    #[serde(flatten)]
    object: &'a T,
}

pub fn print(object: &impl Serialize, out: &mut impl Write) -> anyhow::Result<()> {
    let line = serde_json::to_string(&Versioned { version: VERSION, object })?;
    Ok(writeln!(out, "{line}")?)
}
