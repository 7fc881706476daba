use std::time::{Duration, Instant};

/// Limits the rate of a warning: it is due at the first event, then at most every 10 s, with the number of events since.
#[derive(Clone, Debug, Default)]
pub struct Repeated {
    count: u64,
    warned_at: Option<Instant>,
}

/// Shortest time between two warnings.
pub const REPEAT_EVERY: Duration = Duration::from_secs(10);

impl Repeated {
    /// Counts events. Returns the number of events to report, if a warning is due.
    pub fn note(&mut self, events: u64, now: Instant) -> Option<u64> {
        self.count += events;
        if self.warned_at.is_some_and(|at| now.saturating_duration_since(at) < REPEAT_EVERY) {
            return None;
        }
        self.warned_at = Some(now);
        Some(std::mem::take(&mut self.count))
    }
}

/// Returns `1 cloud`, `2 clouds`.
pub fn counted(count: u64, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_between_warnings_are_counted() {
        let (mut warning, start) = (Repeated::default(), Instant::now());
        let reports: Vec<(u32, u64)> = (0..250)
            .filter_map(|tick| Some((tick, warning.note(1, start + Duration::from_millis(100) * tick)?)))
            .collect();
        assert_eq!(reports, [(0, 1), (100, 100), (200, 100)]);
    }
}
