use super::Occupancy;
use crate::config::MapConfig;
use crate::sensor::{Evidence, Probabilities};

/// Computes [`Occupancy::of`] for many voxels.
pub(super) struct Occupancies<'a> {
    config: &'a MapConfig,
    probabilities: Probabilities,
}

impl<'a> Occupancies<'a> {
    pub(super) fn new(config: &'a MapConfig) -> Self {
        Self { config, probabilities: Probabilities::default() }
    }

    #[inline]
    pub(super) fn of(&mut self, Evidence { log_odds, .. }: Evidence) -> Occupancy {
        Occupancy::with_probability(self.config, log_odds, self.probabilities.of(log_odds))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cached_values_equal_computed_ones() {
        let config = MapConfig::new(0.1, 10.0).unwrap();
        let mut occupancies = Occupancies::new(&config);
        // More values than fit in the cache, each several times.
        for number in 0..20_000_u32 {
            let log_odds = f64::from(number * 7919 % 1009) * 0.01 - 5.0;
            let evidence = Evidence { log_odds, observation_count: 1 };
            assert_eq!(occupancies.of(evidence), Occupancy::of(&config, Some(evidence)));
        }
        for log_odds in [0.0, -0.0, 1e-300, f64::MAX] {
            let evidence = Evidence { log_odds, observation_count: 1 };
            assert_eq!(occupancies.of(evidence), Occupancy::of(&config, Some(evidence)));
        }
    }
}
