use std::time::Duration;

/// Limits the rate of answers: a token bucket that holds the bytes of one second.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TokenBucket {
    bytes: u64,
    at: Duration,
}

impl TokenBucket {
    /// Refills the bucket; returns whether it holds any bytes.
    pub(super) fn refill(&mut self, bytes_per_s: u64, now: Duration) -> bool {
        let passed = now.saturating_sub(self.at).as_millis().min(1000) as u64;
        self.bytes = (self.bytes + bytes_per_s.saturating_mul(passed) / 1000).min(bytes_per_s);
        self.at = self.at.max(now);
        self.bytes > 0
    }

    /// Removes the bytes of an answer.
    pub(super) fn spend(&mut self, bytes: u64) {
        self.bytes = self.bytes.saturating_sub(bytes);
    }
}
