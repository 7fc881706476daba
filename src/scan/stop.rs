use crate::error::{Error, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// A request to stop the insertion of a scan. Clones share the request.
#[derive(Clone, Debug, Default)]
pub struct Stop {
    is_requested: Arc<AtomicBool>,
    /// From then on it counts as requested.
    at: Option<Instant>,
}

impl Stop {
    /// A stop that is requested by itself after some time.
    pub fn after(time: Duration) -> Self {
        Self { is_requested: Arc::default(), at: Instant::now().checked_add(time) }
    }

    /// Requests the stop. It cannot be withdrawn.
    pub fn set(&self) {
        self.is_requested.store(true, Ordering::Relaxed);
    }

    /// Whether a stop was requested.
    pub fn is_set(&self) -> bool {
        self.is_requested.load(Ordering::Relaxed) || self.at.is_some_and(|at| Instant::now() >= at)
    }

    /// The flag itself, for a signal handler to set.
    pub fn flag(&self) -> Arc<AtomicBool> {
        self.is_requested.clone()
    }

    /// Fails if a stop was requested.
    ///
    /// # Errors
    ///
    /// [`Error::Stopped`].
    pub fn check(&self) -> Result<()> {
        if self.is_set() { Err(Error::Stopped) } else { Ok(()) }
    }
}
