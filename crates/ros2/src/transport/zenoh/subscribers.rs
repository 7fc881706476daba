use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};
use zenoh::sample::SampleKind;

/// Tokens of the subscriptions of a topic that are there now.
#[derive(Clone, Debug, Default)]
pub struct Listeners(Arc<Mutex<BTreeSet<String>>>);

/// More are not told apart: no flood of tokens is kept.
const MOST: usize = 1024;
const LONGEST_TOKEN: usize = 2048;

impl Listeners {
    /// A token has come or gone.
    pub fn note(&self, token: &str, kind: SampleKind) {
        let mut tokens = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match kind {
            SampleKind::Put if tokens.len() < MOST && token.len() <= LONGEST_TOKEN => {
                tokens.insert(token.to_owned());
            }
            SampleKind::Put => log::debug!("a subscription more than {MOST} is not counted"),
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
        let listeners = Listeners::default();
        for number in 0..2 * MOST {
            listeners.note(&format!("token/{number}"), SampleKind::Put);
        }
        listeners.note(&"x".repeat(LONGEST_TOKEN + 1), SampleKind::Put);
        assert_eq!(listeners.count(), MOST);
        listeners.note("token/3", SampleKind::Delete);
        listeners.note("token/3", SampleKind::Delete);
        assert_eq!(listeners.count(), MOST - 1);
    }
}
