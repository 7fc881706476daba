use crate::config::MapConfig;
use crate::sensor::{Evidence, probability_of};

/// Occupancy of a voxel or octree node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Occupancy {
    /// Never observed, or outside the map.
    Unknown,
    /// Observed and free, with the probability of being occupied.
    Free(f64),
    /// Observed and occupied, with the probability of being occupied.
    Occupied(f64),
}

/// Treatment of unknown space in a query.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UnknownAs {
    /// Rays and bodies pass through it.
    #[default]
    Free,
    /// It stops a ray, and a body collides with it.
    Obstacle,
}

impl Occupancy {
    /// Returns the occupancy for a voxel's evidence. The comparison uses log-odds, so it does not depend on the
    /// rounding of a probability.
    #[inline]
    pub fn of(config: &MapConfig, evidence: Option<Evidence>) -> Self {
        Self::of_log_odds(config, evidence.map(|evidence| evidence.log_odds))
    }

    /// Returns the occupancy for log-odds.
    #[inline]
    pub fn of_log_odds(config: &MapConfig, log_odds: Option<f64>) -> Self {
        match log_odds {
            None => Self::Unknown,
            Some(log_odds) if log_odds >= config.occupied_log_odds() => {
                Self::Occupied(probability_of(log_odds))
            }
            Some(log_odds) => Self::Free(probability_of(log_odds)),
        }
    }

    /// Returns whether the voxel was observed and is free.
    #[inline]
    pub const fn is_free(&self) -> bool {
        matches!(self, Self::Free(_))
    }

    /// Returns whether the voxel was never observed.
    #[inline]
    pub const fn is_unknown(&self) -> bool {
        matches!(self, Self::Unknown)
    }

    /// Returns whether the voxel is occupied.
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
