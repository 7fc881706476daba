use crate::octree::Octree;
use crate::space::MortonCode;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard, TryLockError};

/// Voxels and their new log-odds, in strictly ascending Morton order.
pub(crate) type Batch = Vec<(MortonCode, f32)>;

/// Pointer tree that one thread writes while others read it, and its pending batches.
///
/// Batches belong to the tree: queries read them, a sync writes them, and they are dropped with the tree.
#[derive(Debug)]
pub(crate) struct SharedTree {
    /// `None` while the tree is being written, and after a panic during a write; it must then be rebuilt from the
    /// table.
    tree: RwLock<Option<Octree>>,
    /// Pending batches, the oldest first. Removing a batch from an intact tree needs the tree's write lock, so a holder
    /// of the read lock finds each update in the tree or here. Lock order: the tree, then this.
    in_flight: Mutex<VecDeque<Batch>>,
    /// Number of nodes and bytes of the tree as of its last change, readable without a lock.
    nodes: AtomicU64,
    bytes: AtomicUsize,
}

impl SharedTree {
    pub(crate) fn new(tree: Octree) -> Self {
        let (nodes, bytes) = (tree.node_count().into(), tree.bytes().into());
        Self { tree: RwLock::new(Some(tree)), in_flight: Mutex::default(), nodes, bytes }
    }

    pub(crate) fn send(&self, batch: Batch) {
        self.in_flight().push_back(batch);
    }

    /// Writes all pending batches and returns the number of their voxels; `None` if the tree is broken.
    pub(crate) fn write_all(&self) -> Option<usize> {
        let written = self.change(|tree| {
            let mut voxels = 0;
            while let Some(batch) = self.take_oldest() {
                tree.write_sorted(&batch);
                voxels += batch.len();
            }
            voxels
        });
        if written.is_none() {
            // The table has these updates, and the tree will be rebuilt from it.
            self.in_flight().clear();
        }
        written
    }

    /// Changes the tree, if it is intact. A panic in `change` breaks it.
    pub(crate) fn change<T>(&self, change: impl FnOnce(&mut Octree) -> T) -> Option<T> {
        let mut place = self.write_lock();
        let mut tree = place.take()?;
        let outcome = change(&mut tree);
        self.put(&mut place, tree);
        Some(outcome)
    }

    /// Replaces the tree by one that includes all pending batches.
    pub(crate) fn replace(&self, tree: Octree) {
        let mut place = self.write_lock();
        self.in_flight().clear();
        self.put(&mut place, tree);
    }

    /// Reads the tree and the pending batches, the oldest first. Returns `None` immediately if the tree is being
    /// written or broken.
    pub(crate) fn try_read<T>(&self, read: impl FnOnce(&Octree, &VecDeque<Batch>) -> T) -> Option<T> {
        let place = match self.tree.try_read() {
            Ok(place) => place,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return None,
        };
        place.as_ref().map(|tree| read(tree, &self.in_flight()))
    }

    /// Reads the tree; `None` if it is broken. Waits while it is being written.
    pub(crate) fn read<T>(&self, read: impl FnOnce(&Octree) -> T) -> Option<T> {
        self.read_lock().as_ref().map(read)
    }

    /// Number of nodes of the tree, without pending batches.
    pub(crate) fn node_count(&self) -> u64 {
        self.nodes.load(Ordering::Relaxed)
    }

    pub(crate) fn bytes(&self) -> usize {
        self.bytes.load(Ordering::Relaxed)
    }

    /// Bytes of memory of pending batches.
    pub(crate) fn in_flight_bytes(&self) -> usize {
        let in_flight = self.in_flight();
        let voxels: usize = in_flight.iter().map(Batch::capacity).sum();
        voxels * size_of::<(MortonCode, f32)>() + in_flight.capacity() * size_of::<Batch>()
    }

    fn put(&self, place: &mut Option<Octree>, tree: Octree) {
        self.nodes.store(tree.node_count(), Ordering::Relaxed);
        self.bytes.store(tree.bytes(), Ordering::Relaxed);
        *place = Some(tree);
    }

    fn take_oldest(&self) -> Option<Batch> {
        self.in_flight().pop_front()
    }

    // Poisoning is ignored: after a panic the value is `None`, never a partially written tree.
    fn read_lock(&self) -> RwLockReadGuard<'_, Option<Octree>> {
        self.tree.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn write_lock(&self) -> RwLockWriteGuard<'_, Option<Octree>> {
        self.tree.write().unwrap_or_else(PoisonError::into_inner)
    }

    fn in_flight(&self) -> MutexGuard<'_, VecDeque<Batch>> {
        self.in_flight.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Clone for SharedTree {
    /// The clone has a copy of the tree and of the pending batches.
    fn clone(&self) -> Self {
        let place = self.read_lock();
        let in_flight = self.in_flight().clone();
        Self {
            tree: RwLock::new(place.clone()),
            in_flight: Mutex::new(in_flight),
            nodes: self.node_count().into(),
            bytes: self.bytes().into(),
        }
    }
}
