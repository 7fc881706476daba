use serde::{Deserialize, Serialize};

/// Treatment of voxels that were never observed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UnknownRule {
    /// Their own distance is unknown, and they shorten no distance.
    #[default]
    Unknown,
    /// They are free.
    Free,
    /// They are obstacles, including all space outside of the map.
    Obstacle,
}

/// Parameters of a distance field.
///
/// ```
/// use voxtile_distance::{DistanceOptions, UnknownRule};
///
/// let options = DistanceOptions::new(2.0).with_unknown(UnknownRule::Free).with_sign(true);
/// assert_eq!(options.max_distance_m, 2.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
#[must_use]
pub struct DistanceOptions {
    /// Cap in metres: larger distances are only known to be larger. From one to 181 voxels.
    pub max_distance_m: f64,
    /// Treatment of unknown voxels.
    pub unknown: UnknownRule,
    /// Whether the voxels of obstacles have minus the distance to the nearest voxel that is free (with
    /// [`UnknownRule::Free`]: free or unknown), instead of 0.
    pub is_signed: bool,
}

impl Default for DistanceOptions {
    /// 5 m, unknown voxels remain unknown, without sign.
    fn default() -> Self {
        Self { max_distance_m: 5.0, unknown: UnknownRule::Unknown, is_signed: false }
    }
}

impl DistanceOptions {
    /// Creates the default options with another cap, in metres.
    pub fn new(max_distance_m: f64) -> Self {
        Self { max_distance_m, ..Self::default() }
    }

    /// Sets the treatment of unknown voxels.
    pub fn with_unknown(self, unknown: UnknownRule) -> Self {
        Self { unknown, ..self }
    }

    /// Sets whether distances inside obstacles are negative.
    pub fn with_sign(self, is_signed: bool) -> Self {
        Self { is_signed, ..self }
    }

    /// Returns whether the field depends on which voxels were observed, not only on the occupied ones.
    pub(crate) fn needs_known(&self) -> bool {
        self.unknown != UnknownRule::Free
    }
}
