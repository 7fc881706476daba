use super::contents::TileContents;
use parking_lot::{Mutex, MutexGuard};

/// What a map holds, behind the lock that the mapper and readers in other threads share. The mapper lets go of it
/// while it waits for the disk.
#[derive(Debug)]
pub(in crate::mapper) struct SharedContents(Mutex<TileContents>);

/// The contents while they are locked.
pub(in crate::mapper) type ContentsGuard<'a> = MutexGuard<'a, TileContents>;

impl SharedContents {
    pub(super) fn new(contents: TileContents) -> Self {
        Self(Mutex::new(contents))
    }

    /// Locks the contents for the mapper.
    pub(super) fn lock(&self) -> ContentsGuard<'_> {
        self.0.lock()
    }

    /// Locks the contents for a reader.
    ///
    /// The mapper changes tiles on all cores while it holds the lock. A worker thread that only waited would keep it
    /// from that, for ever if all of them did.
    pub(in crate::mapper) fn lock_to_read(&self) -> ContentsGuard<'_> {
        while rayon::current_thread_index().is_some() {
            if let Some(guard) = self.0.try_lock() {
                return guard;
            }
            if rayon::yield_now() != Some(rayon::Yield::Executed) {
                std::thread::yield_now();
            }
        }
        self.0.lock()
    }
}

/// Does something without the lock, which is held again afterwards.
pub(super) fn unlocked<T>(contents: &mut ContentsGuard<'_>, wait: impl FnOnce() -> T) -> T {
    MutexGuard::unlocked(contents, wait)
}
