use crate::maths::sigmoid;
use std::cell::Cell;

const KEPT_BITS: u32 = 8;

thread_local! {
    /// Log-odds bits and probability, indexed by a hash of the log-odds. All entries are valid, so that there is no
    /// check for empty ones.
    static KEPT: [Cell<(u64, f64)>; 1 << KEPT_BITS] =
        const { [const { Cell::new((f64::NAN.to_bits(), f64::NAN)) }; 1 << KEPT_BITS] };
}

/// Returns [`Evidence::probability`](super::Evidence::probability) of log-odds, from a cache of the thread. Most voxels
/// have one of a few log-odds values, and computing a probability takes as long as finding its voxel.
#[inline]
pub fn probability_of(log_odds: f64) -> f64 {
    let bits = log_odds.to_bits();
    let place = bits.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (64 - KEPT_BITS);
    KEPT.with(|kept| {
        let kept = &kept[place as usize];
        let (of, probability) = kept.get();
        if of == bits { probability } else { computed(log_odds, kept) }
    })
}

/// Separate, so that the caller is small enough to be inlined.
#[cold]
#[inline(never)]
fn computed(log_odds: f64, kept: &Cell<(u64, f64)>) -> f64 {
    let probability = sigmoid(log_odds);
    kept.set((log_odds.to_bits(), probability));
    probability
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cached_values_equal_computed_ones() {
        // The 1009 values do not fit in the cache, and each occurs several times.
        for number in 0..20_000_u32 {
            let log_odds = f64::from(number * 7919 % 1009) * 0.01 - 5.0;
            assert_eq!(probability_of(log_odds), sigmoid(log_odds));
        }
        for log_odds in [0.0, -0.0, 1e-300, f64::MAX, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(probability_of(log_odds), sigmoid(log_odds));
        }
        assert!(probability_of(f64::NAN).is_nan());
    }
}
