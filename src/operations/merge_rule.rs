use crate::config::MapConfig;
use crate::sensor::{Evidence, LogOdds, SensorModel};

/// Whose evidence a merged map has of a voxel that several maps know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prefer {
    /// That of the map that was named first.
    First,
    /// That of the map that was named last.
    Last,
    /// That with more observations; of as many, that of the map that was named first.
    MoreObserved,
}

/// What becomes of the evidence that several maps have of a voxel.
#[derive(Clone, Copy, Debug)]
pub(super) enum MergeRule {
    /// Log-odds are added in the order of the maps and clamped once, at the end; so are counts, up to the largest.
    Add { min: f64, max: f64 },
    /// One map's evidence, as it is.
    Take(Prefer),
}

impl MergeRule {
    /// The rule for maps of the same configuration; `None` if it takes a preference and there is none.
    pub(super) fn of(config: &MapConfig, prefer: Option<Prefer>) -> Option<Self> {
        match (prefer, config.sensor_model) {
            (Some(prefer), _) => Some(Self::Take(prefer)),
            (None, SensorModel::LogOdds(LogOdds { min, max, .. })) => Some(Self::Add { min, max }),
            (None, _) => None,
        }
    }

    /// The evidence of a voxel, from that of the maps that know it, in their order; there is at least one.
    pub(super) fn evidence(self, known: &[Evidence]) -> Option<Evidence> {
        match self {
            Self::Add { min, max } => {
                // From the first value on, not from 0: that would turn -0 into 0.
                let sum = known.iter().copied().reduce(|sum, next| Evidence {
                    log_odds: sum.log_odds + next.log_odds,
                    observation_count: sum.observation_count.saturating_add(next.observation_count),
                })?;
                Some(Evidence { log_odds: sum.log_odds.clamp(min, max), ..sum })
            }
            Self::Take(Prefer::First) => known.first().copied(),
            Self::Take(Prefer::Last) => known.last().copied(),
            Self::Take(Prefer::MoreObserved) => known.iter().copied().reduce(|best, next| {
                if next.observation_count > best.observation_count { next } else { best }
            }),
        }
    }
}
