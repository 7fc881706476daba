use super::{Evidence, Iwlo, LogOdds};
use crate::error::Result;
use serde::{Deserialize, Serialize};

/// How observations become evidence; chosen when a map is created and kept in its `metadata.json`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum SensorModel {
    /// OctoMap's model.
    LogOdds(LogOdds),
    /// Intensity-weighted log-odds.
    Iwlo(Iwlo),
}

/// What one ray says about one voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Observation {
    /// The ray ended in the voxel; the intensity of its echo (ignored by models that need none).
    Hit(f32),
    /// The ray passed through the voxel.
    Miss,
}

impl Default for SensorModel {
    fn default() -> Self {
        Self::LogOdds(LogOdds::default())
    }
}

impl SensorModel {
    /// The model, or what is wrong with it.
    pub fn validated(self) -> Result<Self> {
        Ok(match self {
            Self::LogOdds(model) => Self::LogOdds(model.validated()?),
            Self::Iwlo(model) => Self::Iwlo(model.validated()?),
        })
    }

    /// Whether hits need an intensity.
    pub const fn needs_intensity(&self) -> bool {
        matches!(self, Self::Iwlo(_))
    }

    /// Whether an observation is evidence at all; with [`Iwlo`] an echo of no weight is none.
    #[inline]
    pub fn is_evidence(&self, observation: Observation) -> bool {
        match (self, observation) {
            (Self::Iwlo(model), Observation::Hit(intensity)) => model.weight(intensity) != 0.0,
            _ => true,
        }
    }

    /// The evidence after an observation; `None` before is a voxel never observed.
    ///
    /// The observation must be evidence by [`SensorModel::is_evidence`].
    #[inline]
    pub fn update(&self, before: Option<Evidence>, observation: Observation) -> Evidence {
        let before = before.unwrap_or(Evidence::PRIOR);
        match (self, observation) {
            (Self::LogOdds(model), Observation::Hit(_)) => model.hit(before),
            (Self::LogOdds(model), Observation::Miss) => model.miss(before),
            (Self::Iwlo(model), Observation::Hit(intensity)) => model.hit(before, model.weight(intensity)),
            (Self::Iwlo(model), Observation::Miss) => model.miss(before),
        }
    }
}
