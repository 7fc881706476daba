use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use voxtile_local::{LocalReader, LocalView};

/// The local map as it is published, and whether anybody wants it: it is made for those who listen alone.
#[derive(Debug, Default)]
pub struct LocalShare {
    is_wanted: AtomicBool,
    reader: Mutex<Option<LocalReader>>,
}

impl LocalShare {
    /// Says whether somebody listens.
    pub fn want(&self, is_wanted: bool) {
        self.is_wanted.store(is_wanted, Ordering::Relaxed);
    }

    pub fn is_wanted(&self) -> bool {
        self.is_wanted.load(Ordering::Relaxed)
    }

    /// From now on there is this map, or none.
    pub fn set(&self, reader: Option<LocalReader>) {
        *self.reader.lock().unwrap_or_else(PoisonError::into_inner) = reader;
    }

    /// The map after its last scan, if there is one.
    pub fn view(&self) -> Option<Arc<LocalView>> {
        self.reader.lock().unwrap_or_else(PoisonError::into_inner).as_ref().map(LocalReader::view)
    }
}
