use parking_lot::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// State shared by the requests to one store: whether it has ever answered, and the time of the last report.
#[derive(Debug)]
pub(super) struct StoreHealth {
    url: String,
    has_answered: AtomicBool,
    reported: Mutex<Option<Instant>>,
}

/// Minimum time between two reports. Several threads may wait for one store.
const REPORT_INTERVAL: Duration = Duration::from_secs(5);

impl StoreHealth {
    /// `url` is the name of the bucket in messages.
    pub(super) fn new(url: &str) -> Self {
        Self { url: url.to_owned(), has_answered: AtomicBool::new(false), reported: Mutex::new(None) }
    }

    /// Returns the name of the bucket in messages.
    pub(super) fn url(&self) -> &str {
        &self.url
    }

    /// Records whether an attempt was answered.
    pub(super) fn record(&self, is_answered: bool) {
        self.has_answered.fetch_or(is_answered, Ordering::Relaxed);
    }

    /// Returns whether any request was answered.
    pub(super) fn has_answered(&self) -> bool {
        self.has_answered.load(Ordering::Relaxed)
    }

    /// Returns whether a wait may be reported now.
    pub(super) fn may_report(&self) -> bool {
        let mut reported = self.reported.lock();
        let is_due = reported.is_none_or(|at| at.elapsed() >= REPORT_INTERVAL);
        if is_due {
            *reported = Some(Instant::now());
        }
        is_due
    }
}
