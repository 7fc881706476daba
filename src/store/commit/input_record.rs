use crate::config::RayConfig;
use crate::space::TileBox;
use crate::store::tiles::tile_version::MAX_NUMBER;
use serde::{Deserialize, Serialize};

/// Most inputs that a map remembers; of more it forgets the earliest.
pub(crate) const MAX_INPUTS: usize = 1000;

/// Most bytes of the name of an input; of a longer one the beginning is kept.
const MAX_NAME_BYTES: usize = 255;

/// Most bytes of `metadata.json` for all inputs; of more the earliest are forgotten. With the longest list of snapshots
/// beside them the file stays below a mebibyte, which is as much as earlier versions read.
const MAX_TEXT_BYTES: usize = 600 << 10;

/// Columns by which `metadata.json` indents an input.
const INDENT: usize = 6;

/// What a map was built from in one go: an input, or what came of an input since the map last took scans of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct InputRecord {
    /// What its builder calls it. Without [`InputRecord::content`] this alone tells it from others.
    pub name: String,
    /// Number of scans in the map before the first of these.
    pub first_scan: u64,
    /// What was taken so far of the input, from its beginning; `None` where the builder does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub content: Option<InputContent>,
    /// What counts of its rays; `None` where the builder does not say, as for maps of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rays: Option<RayConfig>,
    /// Whether its points were taken without rays; `None` as for `rays`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub is_hits_alone: Option<bool>,
}

/// The scans of an input that a map has taken, from the input's beginning: how many, and what tells them from others.
///
/// Scans and poses are told apart, each by a chain: the same beginnings have the same chain, and whoever has read so
/// many scans can go on from it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputContent {
    /// Number of scans, those that were skipped among them.
    pub scans: u64,
    /// What the first scan with points is; `None` if there was none among the first few.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub begins_with: Option<String>,
    /// The chain of the scans, 32 hexadecimal digits.
    pub scan_chain: String,
    /// The chain of their poses, likewise; empty once the map was mapped again by others.
    pub pose_chain: String,
    /// Numbers of the scans, from 0, that were skipped because they could not be read.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub skipped: Vec<u64>,
}

impl InputRecord {
    /// The same of another region, for a map of several.
    pub(crate) fn with_region(mut self, region: Option<TileBox>) -> Self {
        self.rays = self.rays.map(|rays| RayConfig { region, ..rays });
        self
    }

    /// Whether the input goes by this name in a map, which may have only the beginning of it.
    pub fn is_named(&self, name: &str) -> bool {
        self.name == name || self.name == beginning_of(name)
    }

    /// What its first scan with points is, if that is known.
    pub fn begins_with(&self) -> Option<&str> {
        self.content.as_ref()?.begins_with.as_deref()
    }

    /// Cuts a name that is too long for a map.
    pub(crate) fn cut_name(&mut self) {
        self.name.truncate(beginning_of(&self.name).len());
    }

    /// Bytes of the input in `metadata.json`.
    fn text_bytes(&self) -> usize {
        let text = serde_json::to_string_pretty(self).expect("plain data of strings and numbers");
        text.len() + INDENT * text.lines().count() + ",\n".len()
    }

    /// Whether all numbers are small enough to be true.
    pub(in crate::store) fn is_sound(&self) -> bool {
        let content = self.content.as_ref();
        self.first_scan <= MAX_NUMBER && content.is_none_or(|content| content.scans <= MAX_NUMBER)
    }
}

/// Forgets the earliest inputs that a map has no room for. Without that its metadata would grow with every input until
/// nobody reads it any more.
pub(in crate::store) fn forget_earliest(inputs: &mut Vec<InputRecord>) {
    let mut left_bytes = Some(MAX_TEXT_BYTES);
    let fits = |input: &&InputRecord| {
        left_bytes = left_bytes.and_then(|left| left.checked_sub(input.text_bytes()));
        left_bytes.is_some()
    };
    let kept = inputs.iter().rev().take(MAX_INPUTS).take_while(fits).count();
    inputs.drain(..inputs.len() - kept);
}

/// As much of a name as a map keeps.
fn beginning_of(name: &str) -> &str {
    let mut ends = (0..=name.len().min(MAX_NAME_BYTES)).rev();
    ends.find_map(|end| name.get(..end)).unwrap_or_default()
}

impl<N: Into<String>> From<N> for InputRecord {
    fn from(name: N) -> Self {
        Self { name: name.into(), ..Self::default() }
    }
}
