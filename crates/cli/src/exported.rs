use crate::json;
use serde_json::Value;
use std::io::Write;

/// What an export has written, for a program and for a person.
pub struct Exported {
    /// What `--json` prints.
    pub json: Value,
    /// Lines.
    pub text: String,
}

impl Exported {
    /// Prints it.
    pub fn print(&self, json: bool, out: &mut impl Write) -> anyhow::Result<()> {
        match json {
            true => json::print(&self.json, out),
            false => Ok(out.write_all(self.text.as_bytes())?),
        }
    }
}
