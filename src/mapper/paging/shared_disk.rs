use super::tile_disk::TileDisk;
use parking_lot::{Mutex, MutexGuard};

/// Disk behind the lock that the mapper and the background flush share.
#[derive(Debug)]
pub(super) struct SharedDisk(Mutex<TileDisk>);

pub(super) type DiskGuard<'a> = MutexGuard<'a, TileDisk>;

impl SharedDisk {
    pub(super) fn new(disk: TileDisk) -> Self {
        Self(Mutex::new(disk))
    }

    pub(super) fn lock(&self) -> DiskGuard<'_> {
        self.0.lock()
    }
}

/// Runs `wait` with the lock released.
pub(super) fn unlocked<T>(disk: &mut DiskGuard<'_>, wait: impl FnOnce() -> T) -> T {
    MutexGuard::unlocked(disk, wait)
}
