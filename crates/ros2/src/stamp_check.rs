use std::collections::HashMap;
use std::time::{Duration, Instant};

/// Tells stamps that cannot be from a clock that has jumped: a robot's whose time was set, a simulation's that began
/// anew. Each child frame is judged by itself: one with a wrong clock costs the others nothing.
#[derive(Debug, Default)]
pub struct StampCheck {
    /// Of all frames.
    newest_ns: Option<i64>,
    children: HashMap<String, Child>,
}

/// What is known of a child frame.
#[derive(Clone, Copy, Debug, Default)]
struct Child {
    newest_ns: Option<i64>,
    taken: Option<Instant>,
    /// Since when there is nothing but stamps far in the future, or far older ones.
    off_since: Option<Instant>,
}

/// What is to be done with a transform.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StampVerdict {
    Take,
    Refuse,
    /// The clock is another one since then: what was known of these frames is of no use. All of them if most have
    /// jumped.
    Jump {
        children: Vec<String>,
        since: Instant,
    },
}

/// So far ahead of all others a stamp is none, unless all of its frame are.
const MAX_AHEAD_NS: i64 = 10_000_000_000;
/// So far behind the last one of its frame it is none, unless all of its frame are.
const MAX_BEHIND_NS: i64 = 2_000_000_000;
/// Bound of what a flood can fill.
const MAX_CHILDREN: usize = 4000;
/// For so long all have to be.
const PROOF: Duration = Duration::from_millis(500);

impl StampCheck {
    pub fn verdict(&mut self, child: &str, stamp_ns: i64, now: Instant) -> StampVerdict {
        let known = self.children.get(child).copied().unwrap_or_default();
        let is_early = self.newest_ns.is_some_and(|newest| stamp_ns > newest.saturating_add(MAX_AHEAD_NS));
        let is_late = known.newest_ns.is_some_and(|newest| stamp_ns < newest.saturating_sub(MAX_BEHIND_NS));
        if !is_early && !is_late {
            self.newest_ns = self.newest_ns.max(Some(stamp_ns));
            let newest_ns = known.newest_ns.max(Some(stamp_ns));
            self.note(child, Child { newest_ns, taken: Some(now), off_since: None });
            return StampVerdict::Take;
        }
        let since = known.off_since.unwrap_or(now);
        if now.saturating_duration_since(since) < PROOF {
            self.note(child, Child { off_since: Some(since), ..known });
            return StampVerdict::Refuse;
        }
        StampVerdict::Jump { children: self.follow(child, stamp_ns, since, now), since }
    }

    /// The frames whose clocks may have jumped, and since when.
    pub fn off(&self) -> impl Iterator<Item = (&str, Instant)> {
        self.children.iter().filter_map(|(child, known)| Some((child.as_str(), known.off_since?)))
    }

    /// Forgets a frame.
    pub fn forget(&mut self, child: &str) {
        self.children.remove(child);
    }

    /// Follows the clock of a child that has been off since then, and returns whose past is of no use.
    fn follow(&mut self, child: &str, stamp_ns: i64, since: Instant, now: Instant) -> Vec<String> {
        let jumped = if self.are_most_off(since) {
            // Frames that were not heard meanwhile have their stamps of the clock before.
            std::mem::take(&mut self.children).into_keys().collect()
        } else {
            vec![child.to_owned()]
        };
        self.note(child, Child { newest_ns: Some(stamp_ns), taken: Some(now), off_since: None });
        // Who goes back alone leaves the time of the others as it is.
        self.newest_ns = self.children.values().filter_map(|known| known.newest_ns).max();
        jumped
    }

    /// Whether more frames are off than have had a stamp taken since then.
    fn are_most_off(&self, since: Instant) -> bool {
        let is_off = |known: &&Child| known.off_since.is_some();
        let is_on_time = |known: &&Child| !is_off(known) && known.taken.is_some_and(|taken| taken >= since);
        self.children.values().filter(is_off).count() > self.children.values().filter(is_on_time).count()
    }

    fn note(&mut self, name: &str, child: Child) {
        if let Some(known) = self.children.get_mut(name) {
            *known = child;
        } else if self.children.len() < MAX_CHILDREN {
            self.children.insert(name.to_owned(), child);
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
            let jump = Jump { children: vec!["base".to_owned()], since: now + Duration::from_millis(100) };
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

    /// How many stamps of a frame are refused while another one has its own clock: both every 10 ms, stamps in seconds.
    fn refused(other_s: impl Fn(i64) -> i64, good_s: impl Fn(i64) -> i64) -> usize {
        let (mut check, start) = (StampCheck::default(), Instant::now());
        let mut refused = 0;
        for number in 0..3000 {
            let now = start + Duration::from_millis(10) * number as u32;
            let elapsed_ns = number * S / 100;
            check.verdict("other", other_s(number) * S, now);
            let verdict = check.verdict("good", good_s(number) * S + elapsed_ns, now);
            if let Jump { children: forgotten, .. } = &verdict {
                assert_eq!(forgotten, &["good"]);
            }
            refused += usize::from(verdict == Refuse);
        }
        refused
    }

    #[test]
    fn a_frame_without_stamps_that_comes_first_costs_the_others_half_a_second() {
        assert_eq!(refused(|_| 0, |_| 1_700_000_000), 50);
    }

    #[test]
    fn a_frame_whose_clock_falls_back_costs_the_others_nothing() {
        assert_eq!(refused(|number| if number < 100 { 1000 } else { 5 }, |_| 1000), 0);
        assert_eq!(refused(|number| if number < 100 { 1000 } else { 90_000 }, |_| 1000), 0);
    }

    #[test]
    fn when_most_frames_go_back_all_are_forgotten() {
        let (mut check, start) = (StampCheck::default(), Instant::now());
        for child in ["rests", "odom", "base", "arm"] {
            assert_eq!(check.verdict(child, 1000 * S, start), Take);
        }
        let mut jumps = Vec::new();
        for number in 1..100 {
            let now = start + Duration::from_millis(20) * number as u32;
            for (child, stamp_s) in [("arm", 1000), ("odom", 5), ("base", 5)] {
                let verdict = check.verdict(child, stamp_s * S + number * S / 50, now);
                if let Jump { children: mut forgotten, .. } = verdict {
                    forgotten.sort_unstable();
                    jumps.push(forgotten.join(" "));
                }
            }
        }
        // The arm is the one that is early then.
        assert_eq!(jumps, ["arm base odom rests", "arm"]);
    }
}
