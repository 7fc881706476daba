use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use voxtile_local::{LocalReader, LocalView};

/// Local map for the publishers, and whether it has subscribers. Without subscribers it is not computed.
#[derive(Debug, Default)]
pub struct LocalShare {
    is_wanted: AtomicBool,
    reader: Mutex<Option<LocalReader>>,
}

impl LocalShare {
    /// Sets whether the local map has subscribers.
    pub fn set_wanted(&self, is_wanted: bool) {
        self.is_wanted.store(is_wanted, Ordering::Relaxed);
    }

    pub fn is_wanted(&self) -> bool {
        self.is_wanted.load(Ordering::Relaxed)
    }

    pub fn set(&self, reader: Option<LocalReader>) {
        *self.reader.lock().unwrap_or_else(PoisonError::into_inner) = reader;
    }

    /// Returns the local map after its last scan, if it exists.
    pub fn view(&self) -> Option<Arc<LocalView>> {
        self.reader.lock().unwrap_or_else(PoisonError::into_inner).as_ref().map(LocalReader::view)
    }
}
