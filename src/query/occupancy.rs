use crate::config::MapConfig;
use crate::maths::sigmoid;
use crate::sensor::Evidence;

/// The occupancy of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Occupancy {
    /// Never observed, or outside the map.
    Unknown,
    /// Observed and free, with the probability of being occupied.
    Free(f64),
    /// Observed and occupied, with the probability of being occupied.
    Occupied(f64),
}

/// How a query treats unknown space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UnknownAs {
    /// It is passed through.
    #[default]
    Free,
    /// It stops a ray, and a body collides with it.
    Obstacle,
}

impl Occupancy {
    /// The occupancy of a voxel's evidence. It is compared in log-odds, so that the rounding of a probability does not
    /// matter.
    #[inline]
    pub fn of(config: &MapConfig, evidence: Option<Evidence>) -> Self {
        Self::of_log_odds(config, evidence.map(|evidence| evidence.log_odds))
    }

    /// The occupancy of log-odds.
    #[inline]
    pub fn of_log_odds(config: &MapConfig, log_odds: Option<f64>) -> Self {
        match log_odds {
            None => Self::Unknown,
            Some(log_odds) => Self::with_probability(config, log_odds, sigmoid(log_odds)),
        }
    }

    /// The occupancy of log-odds whose probability is known.
    #[inline]
    pub(super) fn with_probability(config: &MapConfig, log_odds: f64, probability: f64) -> Self {
        match log_odds >= config.occupied_log_odds() {
            true => Self::Occupied(probability),
            false => Self::Free(probability),
        }
    }

    /// Whether the place was observed and is free.
    #[inline]
    pub const fn is_free(&self) -> bool {
        matches!(self, Self::Free(_))
    }

    /// Whether the place was never observed.
    #[inline]
    pub const fn is_unknown(&self) -> bool {
        matches!(self, Self::Unknown)
    }

    /// Whether the place is known to be occupied.
    pub const fn is_occupied(&self) -> bool {
        matches!(self, Self::Occupied(_))
    }

    /// Probability of being occupied; `None` if unknown.
    pub const fn probability(&self) -> Option<f64> {
        match self {
            Self::Unknown => None,
            Self::Free(probability) | Self::Occupied(probability) => Some(*probability),
        }
    }
}
