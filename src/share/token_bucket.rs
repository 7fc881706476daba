use std::time::Duration;

/// Bytes that answers may take.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Allowance {
    bytes: u64,
    at: Duration,
}

impl Allowance {
    /// Takes bytes, if there are any left at this time.
    pub(super) fn take(&mut self, bytes_per_s: u64, now: Duration) -> bool {
        let passed = now.saturating_sub(self.at).as_millis().min(1000) as u64;
        self.bytes = (self.bytes + bytes_per_s.saturating_mul(passed) / 1000).min(bytes_per_s);
        self.at = self.at.max(now);
        self.bytes > 0
    }

    /// Notes what was taken.
    pub(super) fn spend(&mut self, bytes: u64) {
        self.bytes = self.bytes.saturating_sub(bytes);
    }
}
