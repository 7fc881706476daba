use super::contents::TileContents;
use shuttle::sync::{Mutex, MutexGuard};
use std::ops::{Deref, DerefMut};

/// Replaces the mapper's type of this name. The scheduler's guards cannot be released temporarily, so `unlocked` drops
/// the guard and locks again.
#[derive(Debug)]
pub(in crate::mapper) struct SharedContents(Mutex<TileContents>);

#[derive(Debug)]
pub(in crate::mapper) struct ContentsGuard<'a> {
    contents: &'a Mutex<TileContents>,
    guard: Option<MutexGuard<'a, TileContents>>,
}

impl SharedContents {
    pub(super) fn new(contents: TileContents) -> Self {
        Self(Mutex::new(contents))
    }

    pub(in crate::mapper) fn lock(&self) -> ContentsGuard<'_> {
        ContentsGuard { contents: &self.0, guard: Some(self.0.lock().unwrap()) }
    }

    pub(super) fn wait_for_views(&self, _: &mut ContentsGuard<'_>) {}
}

impl Deref for ContentsGuard<'_> {
    type Target = TileContents;

    fn deref(&self) -> &TileContents {
        self.guard.as_ref().expect("contents are accessed only while locked")
    }
}

impl DerefMut for ContentsGuard<'_> {
    fn deref_mut(&mut self) -> &mut TileContents {
        self.guard.as_mut().expect("contents are accessed only while locked")
    }
}

pub(super) fn unlocked<T>(contents: &mut ContentsGuard<'_>, wait: impl FnOnce() -> T) -> T {
    contents.guard = None;
    let answer = wait();
    contents.guard = Some(contents.contents.lock().unwrap());
    answer
}
