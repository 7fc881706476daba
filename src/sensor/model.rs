use super::{Evidence, Iwlo, LogOdds};
use crate::error::Result;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Sensor model, which turns observations into evidence. It is chosen when a map is created, and stored in its
/// `metadata.json`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum SensorModel {
    /// OctoMap's model.
    LogOdds(LogOdds),
    /// Intensity-weighted log-odds.
    Iwlo(Iwlo),
}

/// Observation of one voxel by one ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Observation {
    /// The ray ended in the voxel, with the intensity of its echo (ignored by models that need none).
    Hit(f32),
    /// The ray passed through the voxel.
    Miss,
}

impl Default for SensorModel {
    fn default() -> Self {
        Self::LogOdds(LogOdds::default())
    }
}

impl fmt::Display for SensorModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LogOdds(model) => model.fmt(f),
            Self::Iwlo(model) => model.fmt(f),
        }
    }
}

impl SensorModel {
    /// Returns the model, if its parameters are valid.
    ///
    /// # Errors
    ///
    /// Same errors as [`LogOdds::validated`] and [`Iwlo::validated`].
    pub fn validated(self) -> Result<Self> {
        Ok(match self {
            Self::LogOdds(model) => Self::LogOdds(model.validated()?),
            Self::Iwlo(model) => Self::Iwlo(model.validated()?),
        })
    }

    /// Smallest and largest log-odds that a voxel can have.
    pub const fn limits(&self) -> [f64; 2] {
        match self {
            Self::LogOdds(model) => [model.min, model.max],
            Self::Iwlo(model) => [model.min, model.max],
        }
    }

    /// Name of the model in commands and metadata.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::LogOdds(_) => "log-odds",
            Self::Iwlo(_) => "iwlo",
        }
    }

    /// Returns whether hits need an intensity.
    pub const fn needs_intensity(&self) -> bool {
        matches!(self, Self::Iwlo(_))
    }

    /// Returns whether an observation is evidence; with [`Iwlo`] an echo of weight 0 is not.
    #[inline]
    pub fn is_evidence(&self, observation: Observation) -> bool {
        match (self, observation) {
            (Self::Iwlo(model), Observation::Hit(intensity)) => model.weight(intensity) != 0.0,
            _ => true,
        }
    }

    /// Returns the evidence after an observation; `before` is `None` for an unobserved voxel.
    ///
    /// The observation must be evidence according to [`SensorModel::is_evidence`].
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

    /// Upper bound of the log-odds after a miss: those of a first miss, or the lower clamp if it is larger. It does not
    /// apply to a voxel whose log-odds were above it before the miss.
    pub(crate) fn max_after_miss(&self) -> f64 {
        let min = match self {
            Self::LogOdds(model) => model.min,
            Self::Iwlo(model) => model.min,
        };
        self.update(None, Observation::Miss).log_odds.max(min)
    }

    /// Returns the evidence after a number of consecutive misses, bit-identical to single updates.
    pub fn update_misses(&self, before: Evidence, misses: u16) -> Evidence {
        let min = match self {
            Self::LogOdds(model) => model.min,
            Self::Iwlo(model) => model.min,
        };
        let mut evidence = before;
        for done in 0..misses {
            // At the clamp a miss only increments the count.
            if done > 0 && evidence.log_odds.to_bits() == min.to_bits() {
                let left = i32::from(misses - done);
                let observation_count = evidence.observation_count.saturating_add(left);
                return Evidence { observation_count, ..evidence };
            }
            evidence = self.update(Some(evidence), Observation::Miss);
        }
        evidence
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_model() -> impl Strategy<Value = SensorModel> {
        let bounds = || (prop::sample::select(vec![-10.0, -2.0, -0.0, 0.0, 0.5]), 0.6..9.0_f64);
        let log_odds = (bounds(), -3.0..-1e-9_f64).prop_map(|((min, max), miss)| {
            SensorModel::LogOdds(LogOdds { min, max, miss, ..LogOdds::default() })
        });
        let iwlo = (bounds(), any::<bool>(), prop::sample::select(vec![0.0, 0.3, 1.0])).prop_map(
            |((min, max), adaptive, ratio)| {
                let iwlo =
                    Iwlo { min, max, adaptive, min_alpha: ratio, adaptive_ratio: ratio, ..Iwlo::default() };
                SensorModel::Iwlo(iwlo)
            },
        );
        prop_oneof![log_odds, iwlo]
    }

    proptest! {
        #[test]
        fn combined_misses_equal_single_ones(
            model in any_model(),
            log_odds in -12.0..12.0_f64,
            observation_count in prop_oneof![0..50_i32, i32::MAX - 50..=i32::MAX],
            misses in prop_oneof![0..20_u16, any::<u16>()],
        ) {
            let before = Evidence { log_odds, observation_count };
            let one_by_one = (0..misses).fold(before, |now, _| model.update(Some(now), Observation::Miss));
            let at_once = model.validated().unwrap().update_misses(before, misses);
            prop_assert_eq!(at_once.log_odds.to_bits(), one_by_one.log_odds.to_bits());
            prop_assert_eq!(at_once.observation_count, one_by_one.observation_count);
        }
    }
}
