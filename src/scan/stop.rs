use crate::error::{Error, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Request to stop the insertion of a scan. Clones share the request.
#[derive(Clone, Debug, Default)]
pub struct Stop {
    is_requested: Arc<AtomicBool>,
    /// Time from which the stop counts as requested.
    at: Option<Instant>,
}

impl Stop {
    /// Creates a stop that is requested automatically after some time.
    pub fn after(time: Duration) -> Self {
        Self { is_requested: Arc::default(), at: Instant::now().checked_add(time) }
    }

    /// Requests the stop, which cannot be revoked.
    pub fn set(&self) {
        self.is_requested.store(true, Ordering::Relaxed);
    }

    /// Returns whether a stop was requested.
    pub fn is_set(&self) -> bool {
        self.is_requested.load(Ordering::Relaxed) || self.at.is_some_and(|at| Instant::now() >= at)
    }

    /// The underlying flag, for example for a signal handler.
    pub fn flag(&self) -> Arc<AtomicBool> {
        self.is_requested.clone()
    }

    /// Checks whether a stop was requested.
    ///
    /// # Errors
    ///
    /// Fails with [`Error::Stopped`] if a stop was requested.
    pub fn check(&self) -> Result<()> {
        if self.is_set() { Err(Error::Stopped) } else { Ok(()) }
    }
}
