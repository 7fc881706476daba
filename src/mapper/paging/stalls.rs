use crate::mapper::statistics::StallCounts;
use hdrhistogram::Histogram;
use std::fmt;
use std::time::Duration;

/// Histogram of the times that the mapping thread waited for the disk.
pub(super) struct Stalls {
    /// In microseconds, to two significant digits.
    times_us: Histogram<u32>,
}

impl Default for Stalls {
    fn default() -> Self {
        let mut times_us = Histogram::new(2).expect("two digits are few enough");
        times_us.auto(true);
        Self { times_us }
    }
}

impl Stalls {
    pub(super) fn note(&mut self, time: Duration) {
        // Cannot fail, because the histogram resizes itself.
        let _ = self.times_us.record(u64::try_from(time.as_micros()).unwrap_or(u64::MAX));
    }

    pub(super) fn counts(&self) -> StallCounts {
        StallCounts {
            count: self.times_us.len(),
            p50_us: self.times_us.value_at_quantile(0.5),
            p99_us: self.times_us.value_at_quantile(0.99),
            worst_us: self.times_us.max(),
        }
    }
}

impl fmt::Debug for Stalls {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.counts().fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_are_counted_with_percentiles() {
        let mut stalls = Stalls::default();
        assert_eq!(stalls.counts(), StallCounts::default());
        (1..=1000).for_each(|ms| stalls.note(Duration::from_millis(ms)));
        let StallCounts { count, p50_us, p99_us, worst_us } = stalls.counts();
        assert_eq!(count, 1000);
        // The histogram keeps two significant digits, so an error of 1 % is allowed.
        for (found, expected) in [(p50_us, 500_000), (p99_us, 990_000), (worst_us, 1_000_000)] {
            assert!(found.abs_diff(expected) * 100 <= expected, "{found} us, {expected} expected");
        }
    }
}
