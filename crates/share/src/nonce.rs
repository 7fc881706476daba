use super::codec::Request;
use std::time::Duration;

/// Generator of nonces, which identify the answers to status requests.
#[derive(Clone, Debug)]
pub(super) struct Nonce {
    state: u64,
    /// Last nonce and its send time; `None` once it is answered.
    waiting: Option<(u64, Duration)>,
    next_at: Duration,
}

/// Time between two status requests.
const STATUS_INTERVAL: Duration = Duration::from_secs(1);
impl Nonce {
    pub(super) fn new(seed: u64) -> Self {
        Self { state: seed, waiting: None, next_at: Duration::ZERO }
    }

    /// Returns a status request if one is due.
    pub(super) fn request(&mut self, now: Duration) -> Option<Request> {
        if now < self.next_at {
            return None;
        }
        self.next_at = now + STATUS_INTERVAL;
        // splitmix64: the period is 2^64, so nonces do not repeat.
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.state;
        bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        let nonce = (bits ^ bits >> 31).max(1);
        self.waiting = Some((nonce, now));
        Some(Request::Status { nonce })
    }

    /// Returns when the request with this nonce was sent, and clears the nonce; `None` for any other nonce.
    pub(super) fn take(&mut self, nonce: u64) -> Option<Duration> {
        let (_, at) = self.waiting.filter(|(waiting, _)| *waiting == nonce)?;
        self.waiting = None;
        Some(at)
    }
}
