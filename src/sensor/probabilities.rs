use crate::maths::sigmoid;

/// Computes [`Evidence::probability`](super::Evidence::probability) for many voxels with a cache. Most voxels have one
/// of a few log-odds values, and computing a probability takes as long as finding its voxel.
#[derive(Clone, Debug)]
pub struct Probabilities {
    /// Log-odds bits and probability, indexed by a hash of the log-odds.
    kept: Vec<(u64, f64)>,
}

const KEPT_BITS: u32 = 8;

impl Probabilities {
    /// Returns the probability of log-odds.
    #[inline]
    pub fn of(&mut self, log_odds: f64) -> f64 {
        let bits = log_odds.to_bits();
        let place = bits.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (64 - KEPT_BITS);
        let kept = &mut self.kept[place as usize];
        if kept.0 != bits {
            *kept = (bits, sigmoid(log_odds));
        }
        kept.1
    }
}

impl Default for Probabilities {
    fn default() -> Self {
        // All entries are valid, so that `of` need not check for empty ones.
        Self { kept: vec![(f64::NAN.to_bits(), sigmoid(f64::NAN)); 1 << KEPT_BITS] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cached_values_equal_computed_ones() {
        let mut probabilities = Probabilities::default();
        // The 1009 values do not fit in the cache, and each occurs several times.
        for number in 0..20_000_u32 {
            let log_odds = f64::from(number * 7919 % 1009) * 0.01 - 5.0;
            assert_eq!(probabilities.of(log_odds), sigmoid(log_odds));
        }
        for log_odds in [0.0, -0.0, 1e-300, f64::MAX, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(probabilities.of(log_odds), sigmoid(log_odds));
        }
        assert!(probabilities.of(f64::NAN).is_nan());
    }
}
