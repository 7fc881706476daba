use std::collections::HashMap;
use std::time::{Duration, Instant};

/// Distinguishes invalid stamps from a jump of the clock, for example when a robot's time is set or a simulation
/// restarts. Each child frame is judged separately, so a wrong clock of one frame does not affect others.
#[derive(Debug, Default)]
pub struct StampCheck {
    /// Newest accepted stamp of all frames.
    newest_ns: Option<i64>,
    children: HashMap<String, Child>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Child {
    newest_ns: Option<i64>,
    taken: Option<Instant>,
    /// Time since which all stamps of the frame were too far ahead or behind; `None` if the last one was accepted.
    off_since: Option<Instant>,
}

/// Decision about a transform.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StampVerdict {
    Take,
    Refuse,
    /// The clock has jumped at `since`. Drop earlier transforms of these frames. If most frames have jumped, these are
    /// all frames.
    Jump {
        children: Vec<String>,
        since: Instant,
    },
}

/// A stamp further ahead of the newest stamp of all frames is refused. If all stamps of a frame are, its clock has
/// jumped.
const MAX_AHEAD_NS: i64 = 10_000_000_000;
/// A stamp further behind the newest stamp of its frame is refused. If all stamps of a frame are, its clock has jumped.
const MAX_BEHIND_NS: i64 = 2_000_000_000;
/// Limit on memory under a flood of frames.
const MAX_CHILDREN: usize = 4000;
/// Time for which all stamps of a frame must be too far ahead or behind before its clock counts as changed.
const CONFIRM_AFTER: Duration = Duration::from_millis(500);

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
        if now.saturating_duration_since(since) < CONFIRM_AFTER {
            self.note(child, Child { off_since: Some(since), ..known });
            return StampVerdict::Refuse;
        }
        StampVerdict::Jump { children: self.accept_jump(child, stamp_ns, since, now), since }
    }

    /// Returns the frames whose clocks may have jumped, each with the time since when.
    pub fn off(&self) -> impl Iterator<Item = (&str, Instant)> {
        self.children.iter().filter_map(|(child, known)| Some((child.as_str(), known.off_since?)))
    }

    /// Returns the newest accepted stamp of a frame.
    pub fn newest_ns(&self, child: &str) -> Option<i64> {
        self.children.get(child)?.newest_ns
    }

    pub fn forget(&mut self, child: &str) {
        self.children.remove(child);
    }

    /// Accepts the new clock of a child that has been off since `since`. Returns the frames whose earlier transforms
    /// are invalid.
    fn accept_jump(&mut self, child: &str, stamp_ns: i64, since: Instant, now: Instant) -> Vec<String> {
        let jumped = if self.are_most_off(since) {
            // Frames without transforms since then have stamps of the old clock.
            std::mem::take(&mut self.children).into_keys().collect()
        } else {
            vec![child.to_owned()]
        };
        self.note(child, Child { newest_ns: Some(stamp_ns), taken: Some(now), off_since: None });
        // A single frame that jumps back does not change the newest stamp of the others.
        self.newest_ns = self.children.values().filter_map(|known| known.newest_ns).max();
        jumped
    }

    /// Returns whether more frames are off than have had a stamp accepted after `since`.
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

    /// Returns the verdicts on stamps in seconds that arrive every 100 ms.
    fn verdicts(check: &mut StampCheck, from: Instant, stamps_s: &[i64]) -> Vec<StampVerdict> {
        let at = |k: usize| from + Duration::from_millis(100) * k as u32;
        stamps_s.iter().enumerate().map(|(k, stamp)| check.verdict("base", stamp * S, at(k))).collect()
    }

    #[test]
    fn stamps_far_in_the_future_are_refused_among_valid_ones() {
        let (mut check, now) = (StampCheck::default(), Instant::now());
        let stamps = [100, 900, 900, 101, 900, 102, 900, 900, 103, 900, 102, 104];
        let expected = [Take, Refuse, Refuse, Take, Refuse, Take, Refuse, Refuse, Take, Refuse, Take, Take];
        assert_eq!(verdicts(&mut check, now, &stamps), expected);
        assert_eq!(check.verdict("base", i64::MAX, now), Refuse);
    }

    #[test]
    fn a_jumped_clock_is_accepted_after_half_a_second() {
        for to in [900, 90] {
            let (mut check, now) = (StampCheck::default(), Instant::now());
            let stamps = [100, to, to, to + 1, to + 1, to + 1, to + 1, to + 2];
            let jump = Jump { children: vec!["base".to_owned()], since: now + Duration::from_millis(100) };
            let expected = [Take, Refuse, Refuse, Refuse, Refuse, Refuse, jump, Take];
            assert_eq!(verdicts(&mut check, now, &stamps), expected, "to {to}");
        }
    }

    #[test]
    fn a_frame_without_updates_for_long_is_not_early() {
        let (mut check, now) = (StampCheck::default(), Instant::now());
        assert_eq!(check.verdict("odom", 100 * S, now), Take);
        for stamp_s in (100..130).step_by(5) {
            assert_eq!(check.verdict("base", stamp_s * S, now), Take);
        }
        assert_eq!(check.verdict("odom", 130 * S, now), Take);
    }

    /// Returns the number of refused stamps of a frame while another frame uses its own clock. Both send every 10 ms;
    /// stamps are in seconds.
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
    fn a_first_frame_with_zero_stamps_delays_others_by_half_a_second() {
        assert_eq!(refused(|_| 0, |_| 1_700_000_000), 50);
    }

    #[test]
    fn a_frame_whose_clock_jumps_does_not_affect_others() {
        assert_eq!(refused(|number| if number < 100 { 1000 } else { 5 }, |_| 1000), 0);
        assert_eq!(refused(|number| if number < 100 { 1000 } else { 90_000 }, |_| 1000), 0);
    }

    #[test]
    fn a_jump_of_most_frames_resets_all() {
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
        // After the reset, the arm's clock is ahead of the others.
        assert_eq!(jumps, ["arm base odom rests", "arm"]);
    }
}
