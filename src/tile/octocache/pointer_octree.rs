use super::octree_statistics::{OctreeLedger, OctreeTimes, Stopwatch};
use super::shared_tree::{Batch, SharedTree};
use super::update_stream::UpdateStream;
use super::voxel_cache::{VoxelCache, VoxelCacheCounts};
use super::work_queue::WorkQueue;
use crate::octree::Octree;
use crate::scan::TileUpdates;
use crate::sensor::SensorModel;
use crate::space::{MortonCode, VoxelIndex};
use crate::tile::octree::max_in_table;
use crate::tile::table::Table;
use std::collections::VecDeque;
use std::sync::Arc;

/// OctoMap's pointer tree of a tile, with or without a voxel cache. Queries give the same answers as if each update had
/// been written directly to the tree.
#[derive(Debug)]
pub(crate) struct PointerOctree {
    cache: Option<VoxelCache>,
    tree: Arc<SharedTree>,
    writer: TreeWriter,
}

/// Writer of a map's trees, and its counts.
#[derive(Clone, Debug)]
pub(crate) struct TreeWriter {
    /// Queue to the thread that writes trees; `None` if the mapping threads do.
    pub(crate) queue: Option<Arc<WorkQueue>>,
    pub(crate) ledger: Arc<OctreeLedger>,
}

impl PointerOctree {
    /// Creates the octree of a table, with an empty cache.
    pub(crate) fn of_table(cache: Option<VoxelCache>, table: &Table, writer: TreeWriter) -> Self {
        Self { cache, tree: Arc::new(SharedTree::new(tree_of(table))), writer }
    }

    /// Applies updates to the table and passes each of them to the cache or the tree, in order; `first` is the tile's
    /// lowest voxel.
    pub(crate) fn apply(
        &mut self,
        table: &mut Table,
        model: &SensorModel,
        first: VoxelIndex,
        updates: &TileUpdates,
    ) {
        let before = self.cache_counts();
        let mut stream = UpdateStream::into(self.cache.as_mut(), &self.tree);
        stream.apply(table, model, first, updates);
        let (mut times, written) = (stream.times, stream.written);
        let mut watch = Stopwatch::start();
        let evicted = self.cache.as_mut().map(VoxelCache::evict).unwrap_or_default();
        times.eviction_ns += watch.lap_ns();
        self.writer.ledger.add_cache(self.cache_counts() - before);
        self.writer.ledger.add_written(written, times);
        if !evicted.is_empty() {
            self.write(evicted);
        }
    }

    /// Writes evicted voxels to the tree, in this thread or the worker.
    fn write(&self, evicted: Batch) {
        let mut watch = Stopwatch::start();
        let voxels = evicted.len();
        // From here on queries see the batch, even if the job fails.
        self.tree.send(evicted);
        let Some(queue) = &self.writer.queue else {
            write_in_flight(&self.tree, &self.writer.ledger, false);
            return;
        };
        let job = {
            // Weak, so that pending batches of an evicted tile are dropped.
            let (tree, ledger) = (Arc::downgrade(&self.tree), self.writer.ledger.clone());
            move || {
                if let Some(tree) = tree.upgrade() {
                    write_in_flight(&tree, &ledger, true);
                }
            }
        };
        match queue.push(voxels, Box::new(job)) {
            Ok(enqueue_wait_ns) => {
                let enqueue_ns = watch.lap_ns();
                self.writer.ledger.add_times(OctreeTimes {
                    enqueue_ns,
                    enqueue_wait_ns,
                    ..OctreeTimes::default()
                });
            }
            // The thread has ended with its mapper, but this tile is still in use.
            Err(_) => {
                write_in_flight(&self.tree, &self.writer.ledger, false);
            }
        }
    }

    /// Returns the largest log-odds of the voxels under the node at `depth` (1 to 16) that contains `code`; `None` if
    /// all are unknown.
    pub(crate) fn max_under(&self, table: &Table, code: MortonCode, depth: u8) -> Option<f32> {
        let (first, span) = (code.ancestor(depth), MortonCode::span(depth));
        let max = self.tree.try_read(|tree, in_flight| {
            let cached = self.cache.as_ref().map(|cache| cache.under(first, span)).unwrap_or_default();
            tree.max_with_overrides(first, depth, &newest_under(first, span, in_flight, cached))
        });
        // A query does not wait for a tree that is being written, because the table has the same answer.
        max.unwrap_or_else(|| max_in_table(table, code, depth))
    }

    /// Returns whether the tree contains all updates.
    pub(crate) fn is_synced(&self) -> bool {
        self.cache.as_ref().is_none_or(VoxelCache::is_empty)
            && self.tree.try_read(|_, in_flight| in_flight.is_empty()).unwrap_or(false)
    }

    /// Writes the cache and all pending batches to the tree, without waiting for the queue.
    pub(crate) fn sync(&mut self, table: &Table) {
        if self.is_synced() {
            return;
        }
        let before = self.cache_counts();
        let mut watch = Stopwatch::start();
        let drained = self.cache.as_mut().map(VoxelCache::drain).unwrap_or_default();
        let times = OctreeTimes { eviction_ns: watch.lap_ns(), ..OctreeTimes::default() };
        self.writer.ledger.add_times(times);
        self.writer.ledger.add_cache(self.cache_counts() - before);
        self.tree.send(drained);
        if !write_in_flight(&self.tree, &self.writer.ledger, false) {
            self.tree.replace(tree_of(table));
        }
    }

    /// Returns an up-to-date copy of the tree.
    pub(crate) fn tree(&self, table: &Table) -> Octree {
        let tree = self.is_synced().then(|| self.tree.read(Octree::clone)).flatten();
        tree.unwrap_or_else(|| tree_of(table))
    }

    /// Counts of the cache; zero without a cache.
    pub(crate) fn cache_counts(&self) -> VoxelCacheCounts {
        self.cache.as_ref().map(VoxelCache::counts).unwrap_or_default()
    }

    /// Number of nodes of the tree, without the cache and pending batches.
    pub(crate) fn node_count(&self) -> u64 {
        self.tree.node_count()
    }

    /// Bytes of memory on the heap: of the tree, and of the cache with pending batches.
    pub(crate) fn bytes(&self) -> (usize, usize) {
        let cache = self.cache.as_ref().map_or(0, VoxelCache::bytes);
        (size_of::<SharedTree>() + self.tree.bytes(), cache + self.tree.in_flight_bytes())
    }

    #[cfg(test)]
    pub(crate) fn shared_tree(&self) -> &Arc<SharedTree> {
        &self.tree
    }
}

impl Clone for PointerOctree {
    /// The clone has its own octree; the writer is shared.
    fn clone(&self) -> Self {
        let tree = Arc::new(SharedTree::clone(&self.tree));
        Self { cache: self.cache.clone(), tree, writer: self.writer.clone() }
    }
}

fn tree_of(table: &Table) -> Octree {
    Octree::from_sorted(table.iter().map(|(code, evidence)| (code, evidence.log_odds as f32)))
}

/// Writes all pending batches. Returns whether the tree is intact, and so up to date.
fn write_in_flight(tree: &SharedTree, ledger: &OctreeLedger, is_worker: bool) -> bool {
    let mut watch = Stopwatch::start();
    let written = tree.write_all();
    let voxels = written.unwrap_or_default();
    let octree_update_ns = watch.lap_ns();
    let worker_update_ns = if is_worker { octree_update_ns } else { 0 };
    ledger.add_written(voxels, OctreeTimes { octree_update_ns, worker_update_ns, ..OctreeTimes::default() });
    written.is_some()
}

/// Returns the voxels of a node that are pending or cached, each with its latest value, in Morton order. `first` is the
/// node's first code, `span` its number of voxels.
fn newest_under(first: MortonCode, span: u64, in_flight: &VecDeque<Batch>, cached: Batch) -> Batch {
    if in_flight.is_empty() {
        return cached;
    }
    let end = MortonCode(first.0 + span);
    let mut newest = cached;
    for batch in in_flight.iter().rev() {
        let position = |code: MortonCode| batch.partition_point(|&(other, _)| other < code);
        newest.extend_from_slice(&batch[position(first)..position(end)]);
    }
    // Stable: for the same voxel the latest value is first, and is kept.
    newest.sort_by_key(|&(code, _)| code);
    newest.dedup_by_key(|&mut (code, _)| code);
    newest
}
