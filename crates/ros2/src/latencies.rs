use std::collections::VecDeque;
use std::time::Duration;

/// Times from arrival to completed mapping of the latest clouds.
#[derive(Clone, Debug, Default)]
pub struct Latencies(VecDeque<Duration>);

const MAX_COUNT: usize = 1000;

impl Latencies {
    pub fn note(&mut self, latency: Duration) {
        if self.0.len() >= MAX_COUNT {
            self.0.pop_front();
        }
        self.0.push_back(latency);
    }

    /// Returns the latency that `percent` of the clouds do not exceed. `None` before the first cloud.
    pub fn percentile(&self, percent: usize) -> Option<Duration> {
        let mut sorted: Vec<Duration> = self.0.iter().copied().collect();
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
