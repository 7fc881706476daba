use std::time::Duration;

/// Token bucket that limits the rate of answers. It holds at most the bytes of one second. An answer may exceed the
/// tokens in the bucket; the next answer then waits until the deficit is refilled.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TokenBucket {
    /// In bytes times nanoseconds: the time between requests may be shorter than the refill time of one byte. Negative
    /// after an answer that exceeded the tokens.
    tokens: i128,
    at: Duration,
}

/// Number of tokens per byte.
const BYTE: i128 = 1_000_000_000;

impl TokenBucket {
    /// Refills the bucket. Returns whether it holds any tokens.
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
