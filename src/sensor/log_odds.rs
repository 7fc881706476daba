use super::Evidence;
use crate::error::{Error, Result};
use crate::maths::logit;
use serde::{Deserialize, Serialize};
use std::fmt;

/// OctoMap's model: a hit adds a constant, a miss adds another one, and the sum is clamped.
///
/// Source: Hornung et al., "OctoMap: an efficient probabilistic 3D mapping framework based on octrees", Autonomous
/// Robots 2013, equations 3 and 4.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LogOdds {
    /// Log-odds added for a hit, positive.
    pub hit: f64,
    /// Log-odds added for a miss, negative.
    pub miss: f64,
    /// Lower clamp in log-odds.
    pub min: f64,
    /// Upper clamp in log-odds.
    pub max: f64,
}

impl Default for LogOdds {
    /// OctoMap's defaults as `f64` bits: the probabilities 0.7 (hit), 0.4 (miss), and the clamps 0.1192 and 0.971.
    fn default() -> Self {
        Self {
            hit: f64::from_bits(0x3feb_1d10_670a_ae98),
            miss: f64::from_bits(0xbfd9_f323_ecbf_984a),
            min: f64::from_bits(0xc000_000e_9762_3951),
            max: f64::from_bits(0x400c_1697_3b36_2fca),
        }
    }
}

impl fmt::Display for LogOdds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { hit, miss, min, max } = self;
        write!(f, "log-odds with hit {hit}, miss {miss}, min {min}, max {max}")
    }
}

impl LogOdds {
    /// Creates a model from probabilities, each in (0, 1).
    ///
    /// # Errors
    ///
    /// Fails with [`InvalidArgument`](crate::Error::InvalidArgument) for other numbers. Otherwise same errors as
    /// [`LogOdds::validated`].
    pub fn from_probabilities(hit: f64, miss: f64, min: f64, max: f64) -> Result<Self> {
        Self { hit: logit(hit), miss: logit(miss), min: logit(min), max: logit(max) }.validated()
    }

    /// Returns the model, if its parameters are valid.
    ///
    /// # Errors
    ///
    /// Fails with [`InvalidArgument`](crate::Error::InvalidArgument) and the reason.
    pub fn validated(self) -> Result<Self> {
        let finite = [self.hit, self.miss, self.min, self.max].iter().all(|value| value.is_finite());
        if !(finite && self.hit > 0.0 && self.miss < 0.0 && self.min < self.max) {
            return Err(Error::argument(
                "sensor model log-odds",
                format!("needs finite values with miss < 0 < hit and min < max, not {self}"),
            ));
        }
        Ok(self)
    }

    #[inline]
    pub(super) fn hit(&self, before: Evidence) -> Evidence {
        before.updated_to((before.log_odds + self.hit).clamp(self.min, self.max))
    }

    #[inline]
    pub(super) fn miss(&self, before: Evidence) -> Evidence {
        before.updated_to((before.log_odds + self.miss).clamp(self.min, self.max))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stored_bits_are_the_logits_of_octomaps_probabilities() {
        let stored = LogOdds::default();
        let computed = LogOdds::from_probabilities(0.7, 0.4, 0.1192, 0.971).unwrap();
        for (stored, computed) in [
            (stored.hit, computed.hit),
            (stored.miss, computed.miss),
            (stored.min, computed.min),
            (stored.max, computed.max),
        ] {
            assert_eq!(stored.to_bits(), computed.to_bits(), "{stored} {computed} {:#x}", computed.to_bits());
        }
    }

    #[test]
    fn updates_add_up_and_stop_at_the_clamps() {
        let model = LogOdds::default();
        let mut evidence = Evidence::PRIOR;
        for _ in 0..10 {
            evidence = model.hit(evidence);
        }
        assert_eq!((evidence.log_odds, evidence.observation_count), (model.max, 10));
        for _ in 0..20 {
            evidence = model.miss(evidence);
        }
        assert_eq!((evidence.log_odds, evidence.observation_count), (model.min, 30));
    }

    #[test]
    fn invalid_parameters_are_rejected() {
        assert!(LogOdds::from_probabilities(0.4, 0.7, 0.1, 0.9).is_err());
        assert!(LogOdds::from_probabilities(0.7, 0.4, 0.9, 0.1).is_err());
        assert!(LogOdds::from_probabilities(f64::NAN, 0.4, 0.1, 0.9).is_err());
        assert!(LogOdds::from_probabilities(1.0, 0.4, 0.1, 0.9).is_err());
    }
}
