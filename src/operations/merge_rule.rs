use crate::config::MapConfig;
use crate::sensor::{Evidence, LogOdds, SensorModel};

/// Preferred map for a voxel that several maps have observed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prefer {
    /// The first map.
    First,
    /// The last map.
    Last,
    /// The map with more observations of the voxel; if equal, the earlier map.
    MoreObserved,
}

/// Rule for the evidence of a voxel that several maps have observed.
#[derive(Clone, Copy, Debug)]
pub(super) enum MergeRule {
    /// Adds log-odds in the order of the maps and clamps the sum. Adds counts, up to the maximum.
    Add { min: f64, max: f64 },
    /// Takes the evidence of one map.
    Take(Prefer),
}

impl MergeRule {
    /// Returns the rule for maps of the same configuration; `None` if a preference is required and missing.
    pub(super) fn of(config: &MapConfig, prefer: Option<Prefer>) -> Option<Self> {
        match (prefer, config.sensor_model) {
            (Some(prefer), _) => Some(Self::Take(prefer)),
            // With guarded clearing, evidence cannot be added: whether a miss counts depends on earlier scans of the
            // same map.
            (None, _) if config.rays.clearing().guard().is_some() => None,
            (None, SensorModel::LogOdds(LogOdds { min, max, .. })) => Some(Self::Add { min, max }),
            (None, _) => None,
        }
    }

    /// Returns the position of the map whose evidence is taken among the maps that have observed a voxel; `None` if the
    /// evidence of all is combined.
    pub(super) fn chosen(self, known: &[Evidence]) -> Option<usize> {
        match self {
            Self::Add { .. } => None,
            Self::Take(Prefer::First) => Some(0),
            Self::Take(Prefer::Last) => known.len().checked_sub(1),
            Self::Take(Prefer::MoreObserved) => (0..known.len()).reduce(|best, next| {
                if known[next].observation_count > known[best].observation_count { next } else { best }
            }),
        }
    }

    /// Combines the evidence of a voxel in the maps that have observed it, in their order. There is at least one.
    pub(super) fn evidence(self, known: &[Evidence]) -> Option<Evidence> {
        match self {
            Self::Add { min, max } => {
                // Start with the first value, not with 0, which would turn -0 into 0.
                let sum = known.iter().copied().reduce(|sum, next| Evidence {
                    log_odds: sum.log_odds + next.log_odds,
                    observation_count: sum.observation_count.saturating_add(next.observation_count),
                })?;
                Some(Evidence { log_odds: sum.log_odds.clamp(min, max), ..sum })
            }
            Self::Take(_) => known.get(self.chosen(known)?).copied(),
        }
    }
}
