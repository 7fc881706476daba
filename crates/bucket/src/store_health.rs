use parking_lot::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// What the requests to one store have in common: whether it has ever answered, and when a wait was reported last.
#[derive(Debug)]
pub(super) struct StoreHealth {
    url: String,
    has_answered: AtomicBool,
    reported: Mutex<Option<Instant>>,
}

/// Several threads may wait for one store: they report one wait in this time.
const REPORT_EVERY: Duration = Duration::from_secs(5);

impl StoreHealth {
    /// `url` is what messages call the bucket.
    pub(super) fn new(url: &str) -> Self {
        Self { url: url.to_owned(), has_answered: AtomicBool::new(false), reported: Mutex::new(None) }
    }

    /// What messages call the bucket.
    pub(super) fn url(&self) -> &str {
        &self.url
    }

    /// Notes whether an attempt was answered.
    pub(super) fn note(&self, is_answered: bool) {
        self.has_answered.fetch_or(is_answered, Ordering::Relaxed);
    }

    /// Whether any request was answered.
    pub(super) fn has_answered(&self) -> bool {
        self.has_answered.load(Ordering::Relaxed)
    }

    /// Whether a wait may be reported now.
    pub(super) fn may_report(&self) -> bool {
        let mut reported = self.reported.lock();
        let is_due = reported.is_none_or(|at| at.elapsed() >= REPORT_EVERY);
        if is_due {
            *reported = Some(Instant::now());
        }
        is_due
    }
}
