use super::contents::TileContents;
use super::views::ViewId;
use parking_lot::{Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// What a map holds, behind the lock that the mapper and readers in other threads share. The mapper lets go of it
/// while it waits for the disk.
#[derive(Debug)]
pub(in crate::mapper) struct SharedContents {
    contents: Mutex<TileContents>,
    /// Notified when a view closes.
    closed: Condvar,
}

/// How long a scan waits for a view to close. Most last for a few milliseconds, and copying the tiles that a scan of a
/// lidar changes takes longer than this.
const MOST_WAIT: Duration = Duration::from_millis(20);

/// The contents while they are locked.
pub(in crate::mapper) type ContentsGuard<'a> = MutexGuard<'a, TileContents>;

impl SharedContents {
    pub(super) fn new(contents: TileContents) -> Self {
        Self { contents: Mutex::new(contents), closed: Condvar::new() }
    }

    /// Locks the contents for the mapper.
    pub(super) fn lock(&self) -> ContentsGuard<'_> {
        self.contents.lock()
    }

    /// Waits a moment for those who look at the map as it is, before it changes.
    pub(super) fn wait_for_views(&self, contents: &mut ContentsGuard<'_>) {
        let until = Instant::now() + MOST_WAIT;
        while contents.views.may_close_soon() {
            if self.closed.wait_until(contents, until).timed_out() {
                contents.views.expect_no_close();
            }
        }
    }

    /// Ends a look at the map.
    pub(in crate::mapper) fn close_view(&self, view: ViewId) {
        let mut contents = self.lock_to_read();
        let dropped = contents.views.close(view);
        drop(contents);
        self.closed.notify_all();
        // After the lock is released: freeing copies of tiles takes time.
        drop(dropped);
    }

    /// Locks the contents for a reader.
    ///
    /// The mapper changes tiles on all cores while it holds the lock. A worker thread that only waited would keep it
    /// from that, for ever if all of them did.
    pub(in crate::mapper) fn lock_to_read(&self) -> ContentsGuard<'_> {
        while rayon::current_thread_index().is_some() {
            if let Some(guard) = self.contents.try_lock() {
                return guard;
            }
            if rayon::yield_now() != Some(rayon::Yield::Executed) {
                std::thread::yield_now();
            }
        }
        self.contents.lock()
    }
}

/// Does something without the lock, which is held again afterwards.
pub(super) fn unlocked<T>(contents: &mut ContentsGuard<'_>, wait: impl FnOnce() -> T) -> T {
    MutexGuard::unlocked(contents, wait)
}
