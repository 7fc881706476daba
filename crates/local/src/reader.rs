use super::changes::VoxelChange;
use super::view::LocalView;
use std::sync::{Arc, Mutex, PoisonError};

/// The published view. Writer and readers hold the lock only to copy a pointer.
#[derive(Debug)]
pub(super) struct Shared(Mutex<Arc<LocalView>>);

impl Shared {
    pub(super) fn new(view: Arc<LocalView>) -> Self {
        Self(Mutex::new(view))
    }

    pub(super) fn set(&self, view: Arc<LocalView>) {
        let before = std::mem::replace(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner), view);
        // Dropped after the lock is released: freeing the old view takes time.
        drop(before);
    }

    fn get(&self) -> Arc<LocalView> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Reads a local map from any thread: it sees whole updates and does not wait for the writer.
#[derive(Clone, Debug)]
pub struct LocalReader {
    shared: Arc<Shared>,
    /// The view of the last call of [`LocalReader::changes`].
    seen: Arc<LocalView>,
}

impl LocalReader {
    pub(super) fn new(shared: Arc<Shared>) -> Self {
        let empty = Arc::new(LocalView::empty(shared.get().grid));
        Self { shared, seen: empty }
    }

    /// The map after the last whole update.
    pub fn view(&self) -> Arc<LocalView> {
        self.shared.get()
    }

    /// The voxels that changed since the last call, in no particular order, and the present view; at the first call,
    /// all voxels.
    pub fn changes(&mut self) -> (Arc<LocalView>, Vec<VoxelChange>) {
        let view = self.view();
        let changes = view.changes_since(&self.seen);
        self.seen = view.clone();
        (view, changes)
    }
}
