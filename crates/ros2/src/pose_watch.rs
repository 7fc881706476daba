use crate::repeated::{REPEAT_EVERY, counted};
use std::time::{Duration, Instant};

/// Detects topics whose clouds get no poses, and reports dropped clouds. Repeats each warning at most every 10 s.
#[derive(Debug)]
pub struct PoseWatch {
    topics: Vec<Topic>,
}

#[derive(Clone, Debug, Default)]
struct Topic {
    name: String,
    /// Time since which no cloud got a pose.
    missed_since: Option<Instant>,
    /// Number of dropped clouds since the last warning, and the time of the first of them.
    dropped: u64,
    dropped_since: Option<Instant>,
    /// Whether the cause may be temporary.
    may_pass: bool,
    warned_at: Option<Instant>,
    /// Whether a warning reported that no cloud gets a pose.
    is_persistent: bool,
    /// Why the last cloud was dropped or has to wait.
    why: String,
}

/// A cloud without a pose.
#[derive(Clone, Copy, Debug)]
pub struct Missed {
    /// Index of its topic.
    pub topic: usize,
    /// Whether its pose may still arrive. If so, the first warning is delayed.
    pub may_pass: bool,
    /// Whether it is dropped; otherwise it waits.
    pub is_dropped: bool,
}

/// Delay before the first warning, because frames are announced one after the other.
const DELAY: Duration = Duration::from_secs(3);

impl PoseWatch {
    pub fn new(topics: Vec<String>) -> Self {
        let topics = topics.into_iter().map(|name| Topic { name, ..Topic::default() });
        Self { topics: topics.collect() }
    }

    /// Records a cloud with a pose.
    pub fn note_found(&mut self, topic: usize) {
        let Some(noted) = self.topics.get_mut(topic) else { return };
        noted.missed_since = None;
        if std::mem::take(&mut noted.is_persistent) {
            log::info!("{}: clouds have poses again", noted.name);
        }
    }

    /// Records a cloud without a pose. Returns a warning if one is due. `why` is called for dropped clouds and for
    /// warnings only.
    pub fn note_missed(
        &mut self,
        missed: Missed,
        now: Instant,
        why: impl FnOnce() -> String,
    ) -> Option<String> {
        let noted = self.topics.get_mut(missed.topic)?;
        noted.missed_since.get_or_insert(now);
        noted.may_pass = missed.may_pass;
        if missed.is_dropped {
            noted.dropped += 1;
            noted.dropped_since.get_or_insert(now);
        }
        if !missed.is_dropped && !noted.is_due(now) {
            return None;
        }
        if missed.is_dropped || noted.dropped == 0 {
            noted.why = why();
        }
        noted.warning(now)
    }

    /// Returns a warning about clouds that were dropped before, if one is due.
    pub fn warning(&mut self, now: Instant) -> Option<String> {
        self.topics.iter_mut().filter(|topic| topic.dropped > 0).find_map(|topic| topic.warning(now))
    }

    /// Returns the reasons for which topics get no poses.
    pub fn problem(&self) -> Option<String> {
        let reasons = self.topics.iter().filter(|topic| topic.is_persistent).map(|topic| topic.why.as_str());
        let reasons: Vec<&str> = reasons.collect();
        (!reasons.is_empty()).then(|| format!("no cloud gets a pose: {}", reasons.join("; ")))
    }
}

impl Topic {
    fn is_due(&self, now: Instant) -> bool {
        let Some(since) = self.missed_since.into_iter().chain(self.dropped_since).min() else { return false };
        let is_early = self.may_pass && now.saturating_duration_since(since) < DELAY;
        let is_recent = |at: Instant| now.saturating_duration_since(at) < REPEAT_EVERY;
        !is_early && !self.warned_at.is_some_and(is_recent)
    }

    fn warning(&mut self, now: Instant) -> Option<String> {
        if !self.is_due(now) {
            return None;
        }
        let dropped = counted(self.dropped, "cloud");
        let what = match self.missed_since {
            Some(since) if !self.may_pass || now.saturating_duration_since(since) >= DELAY => {
                self.is_persistent = true;
                let elapsed = now.saturating_duration_since(since).as_secs_f64();
                let time = if elapsed < 1.0 { String::new() } else { format!(" for {elapsed:.0} s") };
                format!("no cloud got a pose{time}, {dropped} dropped")
            }
            _ => format!("{dropped} dropped without a pose"),
        };
        self.warned_at = Some(now);
        (self.dropped, self.dropped_since) = (0, None);
        Some(format!("{}: {what}: {}", self.name, self.why))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WAITS: Missed = Missed { topic: 1, may_pass: true, is_dropped: false };
    const DROPPED: Missed = Missed { is_dropped: true, ..WAITS };

    fn watch() -> PoseWatch {
        PoseWatch::new(vec!["/front".to_owned(), "/rear".to_owned()])
    }

    #[test]
    fn persistent_problems_are_reported_repeatedly() {
        let (mut watch, start) = (watch(), Instant::now());
        let mut reports = Vec::new();
        for tick in 0..250 {
            let now = start + Duration::from_millis(100) * tick;
            let missed = if tick % 10 == 9 { DROPPED } else { WAITS };
            reports.extend(watch.note_missed(missed, now, || "no map".to_owned()));
            assert_eq!(watch.problem().is_some(), tick >= 30);
        }
        let expected = [(3, 3), (13, 10), (23, 10)].map(|(seconds, dropped)| {
            format!("/rear: no cloud got a pose for {seconds} s, {dropped} clouds dropped: no map")
        });
        assert_eq!(reports, expected);
        watch.note_found(0);
        assert_eq!(watch.problem().as_deref(), Some("no cloud gets a pose: no map"));
        watch.note_found(1);
        assert_eq!(watch.problem(), None);
        let left = watch.note_missed(WAITS, start + Duration::from_secs(99), String::new);
        assert_eq!(left.as_deref(), Some("/rear: 2 clouds dropped without a pose: no map"));
        watch.note_found(1);
        assert_eq!(watch.note_missed(WAITS, start + Duration::from_secs(199), String::new), None);
        let permanent = Missed { topic: 0, may_pass: false, is_dropped: true };
        assert!(watch.note_missed(permanent, start, String::new).is_some());
    }

    #[test]
    fn single_drops_are_reported_with_their_number() {
        let (mut watch, start) = (watch(), Instant::now());
        let at = |seconds| start + Duration::from_secs(seconds);
        for second in 0..20 {
            // Other clouds get their poses.
            let report = watch.note_missed(DROPPED, at(second), || format!("late {second}"));
            watch.note_found(1);
            assert_eq!(watch.warning(at(second) + Duration::from_millis(500)), None);
            let expected = match second {
                3 => Some("/rear: 4 clouds dropped without a pose: late 3".to_owned()),
                13 => Some("/rear: 10 clouds dropped without a pose: late 13".to_owned()),
                _ => None,
            };
            // A warning is due 3 s after the first drop, and 10 s after the previous warning.
            assert_eq!(report, expected, "{second}");
            assert_eq!(watch.problem(), None);
        }
        // The last ones are reported although no other cloud is dropped.
        assert_eq!(watch.warning(at(22)), None);
        let last = Some("/rear: 6 clouds dropped without a pose: late 19".to_owned());
        assert_eq!((watch.warning(at(23)), watch.warning(at(40))), (last, None));
    }
}
