use super::changes::VoxelChange;
use super::view::LocalView;
use std::sync::{Arc, Mutex, PoisonError};

/// The published view. The lock is held only to copy a pointer.
#[derive(Debug)]
pub(super) struct Shared(Mutex<Arc<LocalView>>);

impl Shared {
    pub(super) fn new(view: Arc<LocalView>) -> Self {
        Self(Mutex::new(view))
    }

    pub(super) fn set(&self, view: Arc<LocalView>) {
        let before = std::mem::replace(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner), view);
        // Dropped after the lock is released because freeing the old view takes time.
        drop(before);
    }

    fn get(&self) -> Arc<LocalView> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Handle to read a local map from any thread. It returns complete updates and does not wait for the writer.
#[derive(Clone, Debug)]
pub struct LocalReader {
    shared: Arc<Shared>,
    /// View returned by the last call of [`LocalReader::changes`].
    seen: Arc<LocalView>,
}

impl LocalReader {
    pub(super) fn new(shared: Arc<Shared>) -> Self {
        let empty = Arc::new(LocalView::empty(shared.get().grid));
        Self { shared, seen: empty }
    }

    /// Returns the map after the last complete update.
    pub fn view(&self) -> Arc<LocalView> {
        self.shared.get()
    }

    /// Returns the current view and the voxels that changed since the last call, in no particular order; all voxels at
    /// the first call.
    pub fn changes(&mut self) -> (Arc<LocalView>, Vec<VoxelChange>) {
        let view = self.view();
        let changes = view.changes_since(&self.seen);
        self.seen = view.clone();
        (view, changes)
    }
}
