use super::tile_disk::TileDisk;
use shuttle::sync::{Mutex, MutexGuard};
use std::ops::{Deref, DerefMut};

/// Replaces the mapper's type of this name. The scheduler's guards cannot be released temporarily, so the guard is
/// dropped and taken again.
#[derive(Debug)]
pub(super) struct SharedDisk(Mutex<TileDisk>);

#[derive(Debug)]
pub(super) struct DiskGuard<'a> {
    disk: &'a Mutex<TileDisk>,
    guard: Option<MutexGuard<'a, TileDisk>>,
}

impl SharedDisk {
    pub(super) fn new(disk: TileDisk) -> Self {
        Self(Mutex::new(disk))
    }

    pub(super) fn lock(&self) -> DiskGuard<'_> {
        DiskGuard { disk: &self.0, guard: Some(self.0.lock().unwrap()) }
    }
}

impl Deref for DiskGuard<'_> {
    type Target = TileDisk;

    fn deref(&self) -> &TileDisk {
        self.guard.as_ref().expect("the disk is accessed only while locked")
    }
}

impl DerefMut for DiskGuard<'_> {
    fn deref_mut(&mut self) -> &mut TileDisk {
        self.guard.as_mut().expect("the disk is accessed only while locked")
    }
}

pub(super) fn unlocked<T>(disk: &mut DiskGuard<'_>, wait: impl FnOnce() -> T) -> T {
    disk.guard = None;
    let answer = wait();
    disk.guard = Some(disk.disk.lock().unwrap());
    answer
}
