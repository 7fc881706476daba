use std::path::Path;
use voxtile::Result;

/// Runs work on the calling thread: the scheduler does not support rayon.
#[derive(Clone, Debug, Default)]
pub(super) struct TileThreads(());

impl TileThreads {
    pub(super) fn own(_: &Path) -> Result<Self> {
        Ok(Self(()))
    }

    pub(super) fn map<T, R>(&self, items: Vec<T>, work: impl Fn(T) -> R) -> Vec<R> {
        items.into_iter().map(work).collect()
    }
}
