//! What `--json` prints: objects of one line, with the version of what their fields mean.

use serde::Serialize;
use std::io::Write;

/// Rises when a field goes or means something else; docs/json.md says what it promises.
const VERSION: u32 = 1;

#[derive(Serialize)]
struct Versioned<'a, T> {
    version: u32,
    #[serde(flatten)]
    object: &'a T,
}

/// Prints an object.
pub fn print(object: &impl Serialize, out: &mut impl Write) -> anyhow::Result<()> {
    let line = serde_json::to_string(&Versioned { version: VERSION, object })?;
    Ok(writeln!(out, "{line}")?)
}
