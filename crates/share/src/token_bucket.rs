use std::time::Duration;

/// Limits the rate of answers: a token bucket that holds the bytes of one second. An answer may take more than there
/// is; the next one waits until that is made up for.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TokenBucket {
    /// In bytes times nanoseconds: requests may come faster than bytes. Negative if more was taken than there was.
    tokens: i128,
    at: Duration,
}

/// Tokens of a byte.
const BYTE: i128 = 1_000_000_000;

impl TokenBucket {
    /// Refills the bucket; returns whether it holds anything.
    pub(super) fn refill(&mut self, bytes_per_s: u64, now: Duration) -> bool {
        let rate = i128::from(bytes_per_s);
        let passed_ns = i128::try_from(now.saturating_sub(self.at).as_nanos()).unwrap_or(i128::MAX);
        self.tokens = self.tokens.saturating_add(rate.saturating_mul(passed_ns)).min(rate * BYTE);
        self.at = self.at.max(now);
        self.tokens > 0
    }

    /// Removes the bytes of an answer.
    pub(super) fn spend(&mut self, bytes: u64) {
        self.tokens = self.tokens.saturating_sub(i128::from(bytes) * BYTE);
    }
}
