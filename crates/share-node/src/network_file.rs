use anyhow::{Context, bail};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Settings that a Zenoh configuration file sets explicitly. Others keep Zenoh's defaults.
#[derive(Default)]
pub struct NetworkFile(Value);

impl NetworkFile {
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let extension = path.extension().and_then(|extension| extension.to_str());
        if !matches!(extension, Some("json" | "json5")) {
            bail!("{}: expected a JSON5 file named *.json5 or *.json", path.display());
        }
        let text = fs::read_to_string(path).with_context(|| format!("{}: cannot read", path.display()))?;
        let value = json5::from_str(&text).with_context(|| format!("{}: invalid JSON5", path.display()))?;
        Ok(Self(value))
    }

    /// Returns whether the file sets a key such as `listen/endpoints`.
    pub fn sets(&self, key: &str) -> bool {
        self.0.pointer(&format!("/{key}")).is_some_and(|value| !value.is_null())
    }
}
