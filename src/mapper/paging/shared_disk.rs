use super::tile_disk::TileDisk;
use parking_lot::{Mutex, MutexGuard};

/// The disk, behind the lock that the mapper shares with the thread that flushes beside it.
#[derive(Debug)]
pub(super) struct SharedDisk(Mutex<TileDisk>);

/// The disk while it is locked.
pub(super) type DiskGuard<'a> = MutexGuard<'a, TileDisk>;

impl SharedDisk {
    pub(super) fn new(disk: TileDisk) -> Self {
        Self(Mutex::new(disk))
    }

    pub(super) fn lock(&self) -> DiskGuard<'_> {
        self.0.lock()
    }
}

/// Does something without the lock, which is held again afterwards.
pub(super) fn unlocked<T>(disk: &mut DiskGuard<'_>, wait: impl FnOnce() -> T) -> T {
    MutexGuard::unlocked(disk, wait)
}
