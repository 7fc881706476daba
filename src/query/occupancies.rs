use super::Occupancy;
use crate::config::MapConfig;
use crate::sensor::Evidence;

/// Makes [`Occupancy::of`] of many voxels: few log-odds are common, and a probability takes as long to compute as its
/// voxel to find. So the last ones are kept.
pub(super) struct Occupancies<'a> {
    config: &'a MapConfig,
    /// By a hash of the log-odds, with their bits.
    kept: Vec<(u64, Occupancy)>,
}

const KEPT_BITS: u32 = 8;

impl<'a> Occupancies<'a> {
    pub(super) fn new(config: &'a MapConfig) -> Self {
        // No evidence has these log-odds: no place is empty.
        let nan = f64::NAN.to_bits();
        Self { config, kept: vec![(nan, Occupancy::Unknown); 1 << KEPT_BITS] }
    }

    /// The occupancy of a voxel's evidence.
    #[inline]
    pub(super) fn of(&mut self, evidence: Evidence) -> Occupancy {
        let bits = evidence.log_odds.to_bits();
        let place = bits.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (64 - KEPT_BITS);
        let kept = &mut self.kept[place as usize];
        if kept.0 != bits {
            *kept = (bits, Occupancy::of(self.config, Some(evidence)));
        }
        kept.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_what_is_computed() {
        let config = MapConfig::new(0.1, 10.0).unwrap();
        let mut occupancies = Occupancies::new(&config);
        // More than are kept, each several times.
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
