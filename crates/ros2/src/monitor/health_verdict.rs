use crate::health::Health;
use crate::refusal::Refusal;
use std::time::{Duration, Instant};

/// Whether a node works, and why not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Verdict {
    pub is_healthy: bool,
    /// One line.
    pub text: String,
}

/// A mapping thread that reports nothing for this time is blocked. A reset or a revert of a large map takes seconds.
const MAX_SILENCE: Duration = Duration::from_secs(60);
/// A refused cloud counts for this time.
const RECENT: Duration = Duration::from_secs(60);

/// Judges the health of the node. Missing clouds and poses are problems of other nodes: they are only reported.
pub fn verdict(health: &Health, pose_problem: Option<String>, now: Instant) -> Verdict {
    let mut problems = Vec::new();
    let since = |at: Instant| now.saturating_duration_since(at);
    if let Some(silence) = health.sampled_at.map(since)
        && silence > MAX_SILENCE
    {
        problems.push(format!("mapping is blocked for {:.0} s", silence.as_secs_f64()));
    }
    if health.has_flush_failed {
        problems.push(format!("the last flush failed: {} scans are not durable", health.unflushed_scans));
    }
    let refused = health.refused_at.filter(|(at, _)| since(*at) <= RECENT).map(|(_, refusal)| refusal);
    match refused {
        Some(Refusal::Disk) => {
            problems.push("clouds are refused: the disk does not read or write".to_owned())
        }
        Some(Refusal::Memory) => {
            problems.push("clouds are refused: the map is at its memory limit".to_owned())
        }
        // One damaged tile or one bad pose does not stop mapping.
        Some(Refusal::Damaged | Refusal::Malformed) | None => {}
    }
    let is_healthy = problems.is_empty();
    let remarks = pose_problem.map(|problem| problem.replace('\n', " "));
    let parts: Vec<String> =
        is_healthy.then(|| "ok".to_owned()).into_iter().chain(problems).chain(remarks).collect();
    Verdict { is_healthy, text: parts.join("; ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn problems_of_the_node_are_unhealthy_and_those_of_others_are_not() {
        let start = Instant::now();
        let at = |seconds| start + Duration::from_secs(seconds);
        let good = Health { sampled_at: Some(start), ..Health::default() };
        let of = |health: &Health, seconds| {
            let Verdict { is_healthy, text } = verdict(health, None, at(seconds));
            (is_healthy, text)
        };
        assert_eq!(of(&good, 1), (true, "ok".to_owned()));
        assert_eq!(of(&Health::default(), 1000), (true, "ok".to_owned()));
        let poses = verdict(&good, Some("no cloud gets a pose".to_owned()), start);
        assert_eq!((poses.is_healthy, &*poses.text), (true, "ok; no cloud gets a pose"));
        assert_eq!(of(&good, 61), (false, "mapping is blocked for 61 s".to_owned()));
        let failed = Health { has_flush_failed: true, unflushed_scans: 7, ..good.clone() };
        assert_eq!(of(&failed, 1), (false, "the last flush failed: 7 scans are not durable".to_owned()));
        let refused =
            |refusal| Health { refused_at: Some((start, refusal)), sampled_at: Some(at(70)), ..good.clone() };
        assert!(!of(&refused(Refusal::Disk), 59).0 && of(&refused(Refusal::Disk), 61).0);
        assert!(!of(&refused(Refusal::Memory), 1).0 && of(&refused(Refusal::Damaged), 1).0);
    }
}
