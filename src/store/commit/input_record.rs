use crate::config::RayConfig;
use crate::space::TileBox;
use crate::store::tiles::tile_version::MAX_NUMBER;
use serde::{Deserialize, Serialize};

/// Most inputs that a map remembers; of more it forgets the earliest.
pub(crate) const MOST_INPUTS: usize = 1000;

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

    /// Whether all numbers are small enough to be true.
    pub(in crate::store) fn is_sound(&self) -> bool {
        let content = self.content.as_ref();
        self.first_scan <= MAX_NUMBER && content.is_none_or(|content| content.scans <= MAX_NUMBER)
    }
}

impl<N: Into<String>> From<N> for InputRecord {
    fn from(name: N) -> Self {
        Self { name: name.into(), ..Self::default() }
    }
}
