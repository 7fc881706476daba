use std::collections::VecDeque;
use std::time::Duration;

/// Times from arrival to completed mapping of the latest clouds.
#[derive(Clone, Debug, Default)]
pub struct Latencies {
    last: VecDeque<Duration>,
    /// Sum and number of all times.
    all: (Duration, u64),
}

const MAX_COUNT: usize = 1000;

impl Latencies {
    pub fn note(&mut self, latency: Duration) {
        if self.last.len() >= MAX_COUNT {
            self.last.pop_front();
        }
        self.last.push_back(latency);
        let (sum, count) = self.all;
        self.all = (sum.saturating_add(latency), count + 1);
    }

    /// Returns the sum and the number of the times of all clouds.
    pub fn all(&self) -> (Duration, u64) {
        self.all
    }

    /// Returns the latency that `percent` of the clouds do not exceed. `None` before the first cloud.
    pub fn percentile(&self, percent: usize) -> Option<Duration> {
        let mut sorted: Vec<Duration> = self.last.iter().copied().collect();
        sorted.sort_unstable();
        let rank = (sorted.len() * percent).div_ceil(100).saturating_sub(1);
        sorted.get(rank).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_of_the_last_thousand() {
        let mut latencies = Latencies::default();
        assert_eq!(latencies.percentile(50), None);
        (0..3000).rev().for_each(|ms| latencies.note(Duration::from_millis(ms)));
        assert_eq!(latencies.percentile(50), Some(Duration::from_millis(499)));
        assert_eq!(latencies.percentile(99), Some(Duration::from_millis(989)));
        assert_eq!(latencies.percentile(100), Some(Duration::from_millis(999)));
    }
}
