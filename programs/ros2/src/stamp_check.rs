use std::collections::HashMap;
use std::time::{Duration, Instant};

/// Tells stamps that cannot be from a clock that has jumped: a robot's whose time was set, a simulation's that began
/// anew.
#[derive(Debug, Default)]
pub struct StampCheck {
    newest_ns: Option<i64>,
    /// Since when there is nothing but stamps far in the future.
    early_since: Option<Instant>,
    /// By child frame: the newest stamp, and since when there is nothing but far older ones.
    children: HashMap<String, (i64, Option<Instant>)>,
}

/// What is to be done with a transform.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StampVerdict {
    Take,
    Refuse,
    /// The clock is another one: what was known of these frames is of no use.
    Jump(Vec<String>),
}

/// So far ahead of all others a stamp is none, unless all are.
const MOST_AHEAD_NS: i64 = 10_000_000_000;
/// So far behind the last one of its frame it is none, unless all are.
const MOST_BEHIND_NS: i64 = 2_000_000_000;
/// Bound of what a flood can fill.
const MOST_CHILDREN: usize = 4000;
/// For so long all have to be.
const PROOF: Duration = Duration::from_millis(500);

impl StampCheck {
    pub fn verdict(&mut self, child: &str, stamp_ns: i64, now: Instant) -> StampVerdict {
        let is_early = self.newest_ns.is_some_and(|newest| stamp_ns > newest.saturating_add(MOST_AHEAD_NS));
        let (newest_ns, late_since) = self.children.get(child).copied().unwrap_or((stamp_ns, None));
        let is_late = stamp_ns < newest_ns.saturating_sub(MOST_BEHIND_NS);
        let since = if is_early { self.early_since } else { late_since };
        if is_early || is_late {
            let since = since.unwrap_or(now);
            if now.saturating_duration_since(since) >= PROOF {
                let before = std::mem::take(self);
                self.newest_ns = Some(stamp_ns);
                self.note(child, stamp_ns, None);
                return StampVerdict::Jump(before.children.into_keys().collect());
            }
            if is_early {
                self.early_since = Some(since);
            } else {
                self.note(child, newest_ns, Some(since));
            }
            return StampVerdict::Refuse;
        }
        self.early_since = None;
        self.newest_ns = Some(self.newest_ns.map_or(stamp_ns, |newest| newest.max(stamp_ns)));
        self.note(child, newest_ns.max(stamp_ns), None);
        StampVerdict::Take
    }

    fn note(&mut self, child: &str, newest_ns: i64, late_since: Option<Instant>) {
        if let Some(known) = self.children.get_mut(child) {
            *known = (newest_ns, late_since);
        } else if self.children.len() < MOST_CHILDREN {
            self.children.insert(child.to_owned(), (newest_ns, late_since));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::StampVerdict::{Jump, Refuse, Take};
    use super::*;

    const S: i64 = 1_000_000_000;

    /// Verdicts on stamps in seconds that come every 100 ms.
    fn verdicts(check: &mut StampCheck, from: Instant, stamps_s: &[i64]) -> Vec<StampVerdict> {
        let at = |k: usize| from + Duration::from_millis(100) * k as u32;
        stamps_s.iter().enumerate().map(|(k, stamp)| check.verdict("base", stamp * S, at(k))).collect()
    }

    #[test]
    fn stamps_far_in_the_future_are_refused_while_others_come() {
        let (mut check, now) = (StampCheck::default(), Instant::now());
        let stamps = [100, 900, 900, 101, 900, 102, 900, 900, 103, 900, 102, 104];
        let expected = [Take, Refuse, Refuse, Take, Refuse, Take, Refuse, Refuse, Take, Refuse, Take, Take];
        assert_eq!(verdicts(&mut check, now, &stamps), expected);
        assert_eq!(check.verdict("base", i64::MAX, now), Refuse);
    }

    #[test]
    fn a_clock_that_jumps_is_followed_after_half_a_second() {
        for to in [900, 90] {
            let (mut check, now) = (StampCheck::default(), Instant::now());
            let stamps = [100, to, to, to + 1, to + 1, to + 1, to + 1, to + 2];
            let jump = Jump(vec!["base".to_owned()]);
            let expected = [Take, Refuse, Refuse, Refuse, Refuse, Refuse, jump, Take];
            assert_eq!(verdicts(&mut check, now, &stamps), expected, "to {to}");
        }
    }

    #[test]
    fn frames_that_rest_for_long_are_not_early() {
        let (mut check, now) = (StampCheck::default(), Instant::now());
        assert_eq!(check.verdict("odom", 100 * S, now), Take);
        for stamp_s in (100..130).step_by(5) {
            assert_eq!(check.verdict("base", stamp_s * S, now), Take);
        }
        assert_eq!(check.verdict("odom", 130 * S, now), Take);
    }
}
