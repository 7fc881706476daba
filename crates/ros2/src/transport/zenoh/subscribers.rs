use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};
use zenoh::sample::SampleKind;

/// Tokens of the current subscriptions of a topic.
#[derive(Clone, Debug, Default)]
pub struct Subscribers(Arc<Mutex<BTreeSet<String>>>);

/// Maximum number of counted subscriptions, which bounds the memory under a flood of tokens.
const MAX_COUNT: usize = 1024;
const MAX_TOKEN_BYTES: usize = 2048;

impl Subscribers {
    /// Records a new or removed token.
    pub fn note(&self, token: &str, kind: SampleKind) {
        let mut tokens = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match kind {
            SampleKind::Put if tokens.len() < MAX_COUNT && token.len() <= MAX_TOKEN_BYTES => {
                tokens.insert(token.to_owned());
            }
            SampleKind::Put => {
                log::debug!("subscription not counted: more than {MAX_COUNT}, or its token is too long")
            }
            SampleKind::Delete => {
                tokens.remove(token);
            }
        }
    }

    pub fn count(&self) -> usize {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_of_tokens_is_not_kept() {
        let subscribers = Subscribers::default();
        for number in 0..2 * MAX_COUNT {
            subscribers.note(&format!("token/{number}"), SampleKind::Put);
        }
        subscribers.note(&"x".repeat(MAX_TOKEN_BYTES + 1), SampleKind::Put);
        assert_eq!(subscribers.count(), MAX_COUNT);
        subscribers.note("token/3", SampleKind::Delete);
        subscribers.note("token/3", SampleKind::Delete);
        assert_eq!(subscribers.count(), MAX_COUNT - 1);
    }
}
