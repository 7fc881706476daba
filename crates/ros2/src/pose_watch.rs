use std::time::{Duration, Instant};

/// Detects topics whose clouds get no poses, and keeps the reason.
#[derive(Debug, Default)]
pub struct PoseWatch {
    topics: Vec<Topic>,
}

#[derive(Clone, Debug, Default)]
struct Topic {
    /// Time since when no cloud got a pose.
    since: Option<Instant>,
    why: String,
    warned_at: Option<Instant>,
}

/// Delay before the first warning, because frames are announced one after the other.
const DELAY: Duration = Duration::from_secs(3);
/// Interval between repeated warnings.
const REPEAT_EVERY: Duration = Duration::from_secs(30);

impl PoseWatch {
    /// Records a cloud with a pose.
    pub fn note_found(&mut self, topic: usize) {
        if let Some(noted) = self.topics.get_mut(topic)
            && let Topic { since: Some(_), warned_at, .. } = std::mem::take(noted)
            && warned_at.is_some()
        {
            log::info!("clouds have poses again");
        }
    }

    /// Records a cloud without a pose. Returns a warning if one is due. If the cause may be temporary, the first
    /// warning is delayed.
    pub fn note_missed(
        &mut self,
        topic: usize,
        now: Instant,
        may_pass: bool,
        why: impl Fn() -> String,
    ) -> Option<String> {
        if self.topics.len() <= topic {
            self.topics.resize(topic + 1, Topic::default());
        }
        let noted = self.topics.get_mut(topic)?;
        let since = *noted.since.get_or_insert(now);
        let waited = now.saturating_duration_since(since);
        if (may_pass && waited < DELAY)
            || noted.warned_at.is_some_and(|at| now.saturating_duration_since(at) < REPEAT_EVERY)
        {
            return None;
        }
        noted.warned_at = Some(now);
        noted.why = why();
        Some(format!("no cloud got a pose for {:.0} s: {}", waited.as_secs_f64(), noted.why))
    }

    /// Returns the reasons for which topics get no poses.
    pub fn problem(&self) -> Option<String> {
        let troubled = self.topics.iter().filter(|topic| topic.warned_at.is_some());
        let reasons: Vec<&str> = troubled.map(|topic| topic.why.as_str()).collect();
        (!reasons.is_empty()).then(|| format!("no cloud gets a pose: {}", reasons.join("; ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn persistent_problems_are_reported_repeatedly() {
        let (mut watch, start) = (PoseWatch::default(), Instant::now());
        let mut reports = 0;
        for tick in 0..700 {
            let now = start + Duration::from_millis(100) * tick;
            reports += usize::from(watch.note_missed(1, now, true, || "no map".to_owned()).is_some());
            assert_eq!(watch.problem().is_some(), tick >= 30);
        }
        assert_eq!(reports, 3);
        watch.note_found(0);
        assert_eq!(watch.problem().as_deref(), Some("no cloud gets a pose: no map"));
        watch.note_found(1);
        assert_eq!(watch.problem(), None);
        assert_eq!(watch.note_missed(1, start + Duration::from_secs(99), true, String::new), None);
        assert!(watch.note_missed(0, start, false, String::new).is_some());
    }
}
