use super::contents::TileContents;
use super::views::ViewId;
use parking_lot::{Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// Contents of a map behind the lock that the mapper and readers in other threads share. The mapper releases the lock
/// while it waits for the disk.
#[derive(Debug)]
pub(in crate::mapper) struct SharedContents {
    contents: Mutex<TileContents>,
    /// Notified when a view closes.
    closed: Condvar,
}

/// Longest time that a scan waits for a view to close. Most views last a few milliseconds, so waiting is usually faster
/// than copying the tiles that a lidar scan changes.
const MAX_WAIT: Duration = Duration::from_millis(20);

pub(in crate::mapper) type ContentsGuard<'a> = MutexGuard<'a, TileContents>;

impl SharedContents {
    pub(super) fn new(contents: TileContents) -> Self {
        Self { contents: Mutex::new(contents), closed: Condvar::new() }
    }

    /// Locks the contents. The holder must not wait for a thread of a shared pool, because all threads of the pool may
    /// be waiting for this lock.
    pub(in crate::mapper) fn lock(&self) -> ContentsGuard<'_> {
        self.contents.lock()
    }

    /// Waits for views of the current state to close, at most [`MAX_WAIT`], before a change.
    pub(super) fn wait_for_views(&self, contents: &mut ContentsGuard<'_>) {
        let until = Instant::now() + MAX_WAIT;
        while contents.views.may_close_soon() {
            if self.closed.wait_until(contents, until).timed_out() {
                contents.views.expect_no_close();
            }
        }
    }

    pub(in crate::mapper) fn close_view(&self, view: ViewId) {
        let mut contents = self.lock();
        let dropped = contents.views.close(view);
        drop(contents);
        self.closed.notify_all();
        // Dropped after the lock is released, because freeing copies of tiles takes time.
        drop(dropped);
    }
}

/// Runs `wait` with the lock released.
pub(super) fn unlocked<T>(contents: &mut ContentsGuard<'_>, wait: impl FnOnce() -> T) -> T {
    MutexGuard::unlocked(contents, wait)
}
