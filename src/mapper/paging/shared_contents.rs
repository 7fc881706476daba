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
const MAX_WAIT: Duration = Duration::from_millis(20);

/// The contents while they are locked.
pub(in crate::mapper) type ContentsGuard<'a> = MutexGuard<'a, TileContents>;

impl SharedContents {
    pub(super) fn new(contents: TileContents) -> Self {
        Self { contents: Mutex::new(contents), closed: Condvar::new() }
    }

    /// Locks the contents. The holder must not wait for a thread of a shared pool: all its threads may be waiting for this
    /// lock.
    pub(in crate::mapper) fn lock(&self) -> ContentsGuard<'_> {
        self.contents.lock()
    }

    /// Waits a moment for those who look at the map as it is, before it changes.
    pub(super) fn wait_for_views(&self, contents: &mut ContentsGuard<'_>) {
        let until = Instant::now() + MAX_WAIT;
        while contents.views.may_close_soon() {
            if self.closed.wait_until(contents, until).timed_out() {
                contents.views.expect_no_close();
            }
        }
    }

    /// Ends a look at the map.
    pub(in crate::mapper) fn close_view(&self, view: ViewId) {
        let mut contents = self.lock();
        let dropped = contents.views.close(view);
        drop(contents);
        self.closed.notify_all();
        // After the lock is released: freeing copies of tiles takes time.
        drop(dropped);
    }
}

/// Does something without the lock, which is held again afterwards.
pub(super) fn unlocked<T>(contents: &mut ContentsGuard<'_>, wait: impl FnOnce() -> T) -> T {
    MutexGuard::unlocked(contents, wait)
}
