use super::changes::VoxelChange;
use super::view::LocalView;
use std::sync::{Arc, Mutex, PoisonError};

/// Where the writer puts each view. Both sides hold the lock for the time of copying a pointer.
#[derive(Debug)]
pub(super) struct Shared(Mutex<Arc<LocalView>>);

impl Shared {
    pub(super) fn new(view: Arc<LocalView>) -> Self {
        Self(Mutex::new(view))
    }

    pub(super) fn set(&self, view: Arc<LocalView>) {
        let before = std::mem::replace(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner), view);
        // Freeing what only the old view held takes time: not with the lock held.
        drop(before);
    }

    fn get(&self) -> Arc<LocalView> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Reads a local map beside its writer, from any thread: it sees whole updates, and waits for none.
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

    /// The voxels that changed since the last call, in no stated order, and the map that they lead to; with the first call,
    /// all that there is.
    pub fn changes(&mut self) -> (Arc<LocalView>, Vec<VoxelChange>) {
        let view = self.view();
        let changes = view.changes_since(&self.seen);
        self.seen = view.clone();
        (view, changes)
    }
}
