use std::time::{Duration, Instant};

/// Notes when the clouds of a topic get no poses, and why.
#[derive(Debug, Default)]
pub struct PoseWatch {
    topics: Vec<Topic>,
}

#[derive(Clone, Debug, Default)]
struct Topic {
    /// Since when no cloud got a pose.
    since: Option<Instant>,
    why: String,
    warned_at: Option<Instant>,
}

/// For so long nothing is said: frames are announced one after the other.
const PATIENCE: Duration = Duration::from_secs(3);
/// How often it is said again.
const AGAIN: Duration = Duration::from_secs(30);

impl PoseWatch {
    /// A cloud has its pose.
    pub fn found(&mut self, topic: usize) {
        if let Some(noted) = self.topics.get_mut(topic)
            && let Topic { since: Some(_), warned_at, .. } = std::mem::take(noted)
            && warned_at.is_some()
        {
            log::info!("clouds have poses again");
        }
    }

    /// A cloud has none. What may pass is reported once it lasts. Returns the warning that is due.
    pub fn missed(
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
        if (may_pass && waited < PATIENCE)
            || noted.warned_at.is_some_and(|at| now.saturating_duration_since(at) < AGAIN)
        {
            return None;
        }
        noted.warned_at = Some(now);
        noted.why = why();
        Some(format!("no cloud got a pose for {:.0} s: {}", waited.as_secs_f64(), noted.why))
    }

    /// Why there are topics whose clouds get no poses.
    pub fn trouble(&self) -> Option<String> {
        let troubled = self.topics.iter().filter(|topic| topic.warned_at.is_some());
        let reasons: Vec<&str> = troubled.map(|topic| topic.why.as_str()).collect();
        (!reasons.is_empty()).then(|| format!("no cloud gets a pose: {}", reasons.join("; ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lasts_is_reported_now_and_then_until_it_ends() {
        let (mut watch, start) = (PoseWatch::default(), Instant::now());
        let mut reports = 0;
        for tick in 0..700 {
            let now = start + Duration::from_millis(100) * tick;
            reports += usize::from(watch.missed(1, now, true, || "no map".to_owned()).is_some());
            assert_eq!(watch.trouble().is_some(), tick >= 30);
        }
        assert_eq!(reports, 3);
        watch.found(0);
        assert_eq!(watch.trouble().as_deref(), Some("no cloud gets a pose: no map"));
        watch.found(1);
        assert_eq!(watch.trouble(), None);
        assert_eq!(watch.missed(1, start + Duration::from_secs(99), true, String::new), None);
        assert!(watch.missed(0, start, false, String::new).is_some());
    }
}
