use crate::tile::VoxelCacheCounts;
use serde::Serialize;
use std::ops::AddAssign;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Work on the pointer trees of a mapper since it was opened, including tiles no longer in memory. All zero if octrees
/// are views of the bricks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct OctreeStatistics {
    /// Counts of the voxel caches.
    pub voxel_cache: VoxelCacheCounts,
    /// Number of voxel updates written to the trees.
    pub voxels_written: u64,
    /// Counts of the queue to the thread that writes the trees.
    pub queue: OctreeQueueCounts,
    /// Time spent in each stage.
    pub times: OctreeTimes,
}

/// Counts of the queue between the mapper and the thread that writes the trees. A batch contains the voxels that one
/// tile's voxel cache evicts after one scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct OctreeQueueCounts {
    /// Batches enqueued.
    pub batches_in: u64,
    /// Voxels enqueued.
    pub voxels_in: u64,
    /// Batches dequeued, including those that a sync had already written or whose tile was evicted.
    pub batches_out: u64,
    /// Voxels in the dequeued batches.
    pub voxels_out: u64,
    /// Maximum number of batches in the queue, including the one being written.
    pub peak_batches: u64,
    /// Maximum number of voxels in the queue, including those of the batch being written.
    pub peak_voxels: u64,
    /// Number of voxels from which the queue is full; a single batch may be larger.
    pub limit_voxels: u64,
    /// Batches that waited for space in the queue.
    pub waits: u64,
}

/// Time spent in the stages from an update to the trees, in nanoseconds, summed over threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct OctreeTimes {
    /// Updating tables.
    pub table_update_ns: u64,
    /// Inserting updates into voxel caches.
    pub cache_insertion_ns: u64,
    /// Evicting from voxel caches, in Morton order.
    pub eviction_ns: u64,
    /// Enqueueing batches, including the wait for space.
    pub enqueue_ns: u64,
    /// Waiting for space in the queue.
    pub enqueue_wait_ns: u64,
    /// Writing the trees, in any thread.
    pub octree_update_ns: u64,
    /// Writing the trees in the worker thread.
    pub worker_update_ns: u64,
    /// Idle time of the worker thread; a wait is counted when it ends.
    pub worker_wait_ns: u64,
}

impl AddAssign for OctreeTimes {
    fn add_assign(&mut self, other: Self) {
        self.table_update_ns += other.table_update_ns;
        self.cache_insertion_ns += other.cache_insertion_ns;
        self.eviction_ns += other.eviction_ns;
        self.enqueue_ns += other.enqueue_ns;
        self.enqueue_wait_ns += other.enqueue_wait_ns;
        self.octree_update_ns += other.octree_update_ns;
        self.worker_update_ns += other.worker_update_ns;
        self.worker_wait_ns += other.worker_wait_ns;
    }
}

/// Statistics to which several threads add, a few times per tile and scan.
#[derive(Debug, Default)]
pub(crate) struct OctreeLedger(Mutex<OctreeStatistics>);

impl OctreeLedger {
    pub(crate) fn sum(&self) -> OctreeStatistics {
        *self.lock()
    }

    pub(crate) fn add_cache(&self, counts: VoxelCacheCounts) {
        self.lock().voxel_cache += counts;
    }

    pub(crate) fn add_times(&self, times: OctreeTimes) {
        self.lock().times += times;
    }

    pub(crate) fn add_written(&self, voxels: usize, times: OctreeTimes) {
        let mut sum = self.lock();
        sum.voxels_written += voxels as u64;
        sum.times += times;
    }

    fn lock(&self) -> MutexGuard<'_, OctreeStatistics> {
        // No code that can panic runs under the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Measures consecutive stages.
pub(crate) struct Stopwatch(Instant);

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self(Instant::now())
    }

    /// Nanoseconds since the start or the last lap.
    pub(crate) fn lap_ns(&mut self) -> u64 {
        let now = Instant::now();
        nanoseconds(now - std::mem::replace(&mut self.0, now))
    }
}

/// Converts a duration to nanoseconds; 64 bits suffice for 584 years.
pub(crate) fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}
