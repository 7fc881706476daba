use anyhow::{Context, bail};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// What a file of Zenoh's configuration says, as against what Zenoh takes where it says nothing.
#[derive(Default)]
pub struct NetworkFile(Value);

impl NetworkFile {
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let extension = path.extension().and_then(|extension| extension.to_str());
        if !matches!(extension, Some("json" | "json5")) {
            bail!(
                "{}: a configuration of the network is JSON5, and its name ends with .json5 or .json",
                path.display()
            );
        }
        let text = fs::read_to_string(path).with_context(|| format!("{}: cannot read", path.display()))?;
        let value = json5::from_str(&text).with_context(|| format!("{}: is no JSON5", path.display()))?;
        Ok(Self(value))
    }

    /// Whether it has something under a key, as in `listen/endpoints`.
    pub fn says(&self, key: &str) -> bool {
        self.0.pointer(&format!("/{key}")).is_some_and(|value| !value.is_null())
    }
}
