use crate::config::RayConfig;
use crate::space::TileBox;
use crate::store::tiles::tile_version::MAX_NUMBER;
use serde::{Deserialize, Serialize};

/// Maximum number of inputs that a map records. The earliest are dropped.
pub(crate) const MAX_INPUTS: usize = 1000;

/// Maximum length of an input's name in bytes. Longer names are truncated.
const MAX_NAME_BYTES: usize = 255;

/// Maximum bytes of all inputs in `metadata.json`. The earliest are dropped. With the longest list of snapshots the
/// file stays below 1 MiB, the limit of earlier versions.
const MAX_TEXT_BYTES: usize = 600 << 10;

/// Indentation of an input in `metadata.json`, in columns.
const INDENT: usize = 6;

/// One contiguous run of scans from one input.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct InputRecord {
    /// Name given by the builder. Without [`InputRecord::content`] only the name identifies the input.
    pub name: String,
    /// Number of scans in the map before this run.
    pub first_scan: u64,
    /// Scans of the input that the map has ingested, from its beginning; `None` if the builder does not report them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub content: Option<InputContent>,
    /// Ray settings; `None` if the builder does not report them, or in maps of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rays: Option<RayConfig>,
    /// Whether points were inserted without rays; `None` as for `rays`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub is_hits_alone: Option<bool>,
}

/// Number and fingerprint of the scans that a map has ingested from an input, from its beginning.
///
/// Scans and poses have separate hash chains. Equal chains mean equal beginnings, so a builder that has read this many
/// scans can resume after them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputContent {
    /// Number of scans, including skipped ones.
    pub scans: u64,
    /// Fingerprint of the first scan with points; `None` if the first few scans have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub begins_with: Option<String>,
    /// Hash chain of the scans, 32 hexadecimal digits; empty after an update in parts.
    pub scan_chain: String,
    /// Hash chain of the poses, 32 hexadecimal digits; empty after a remap with other poses.
    pub pose_chain: String,
    /// Indices of scans, from 0, that were skipped because they could not be read.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub skipped: Vec<u64>,
}

impl InputRecord {
    /// Replaces the region in the ray settings, for a map joined from several regions.
    pub(crate) fn with_region(mut self, region: Option<TileBox>) -> Self {
        self.rays = self.rays.map(|rays| RayConfig { region, ..rays });
        self
    }

    /// Returns whether the input has this name. The record may contain only its beginning.
    pub fn is_named(&self, name: &str) -> bool {
        self.name == name || self.name == beginning_of(name)
    }

    /// Fingerprint of the first scan with points, if known.
    pub fn begins_with(&self) -> Option<&str> {
        self.content.as_ref()?.begins_with.as_deref()
    }

    pub(crate) fn cut_name(&mut self) {
        self.name.truncate(beginning_of(&self.name).len());
    }

    /// Length of the input in `metadata.json` in bytes.
    fn text_bytes(&self) -> usize {
        let text = serde_json::to_string_pretty(self).expect("plain data of strings and numbers");
        text.len() + INDENT * text.lines().count() + ",\n".len()
    }

    /// Returns whether all numbers are at most [`MAX_NUMBER`].
    pub(in crate::store) fn is_sound(&self) -> bool {
        let content = self.content.as_ref();
        self.first_scan <= MAX_NUMBER && content.is_none_or(|content| content.scans <= MAX_NUMBER)
    }
}

/// Drops the earliest inputs beyond the limits. Otherwise the metadata could grow until it exceeds the limit of its
/// readers.
pub(in crate::store) fn forget_earliest(inputs: &mut Vec<InputRecord>) {
    let mut left_bytes = Some(MAX_TEXT_BYTES);
    let fits = |input: &&InputRecord| {
        left_bytes = left_bytes.and_then(|left| left.checked_sub(input.text_bytes()));
        left_bytes.is_some()
    };
    let kept = inputs.iter().rev().take(MAX_INPUTS).take_while(fits).count();
    inputs.drain(..inputs.len() - kept);
}

/// Returns the part of a name that a map keeps.
fn beginning_of(name: &str) -> &str {
    let mut ends = (0..=name.len().min(MAX_NAME_BYTES)).rev();
    ends.find_map(|end| name.get(..end)).unwrap_or_default()
}

impl<N: Into<String>> From<N> for InputRecord {
    fn from(name: N) -> Self {
        Self { name: name.into(), ..Self::default() }
    }
}
