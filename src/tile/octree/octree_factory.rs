use super::brick_octree::BrickOctree;
use super::tile_octree::TileOctree;
use crate::config::{OctreeConfig, VoxelCacheMode};
use crate::tile::OctreeStatistics;
use crate::tile::octocache::{OctreeLedger, OctreeWorker, PointerOctree, TreeWriter, VoxelCache};
use crate::tile::table::Table;
use std::sync::Arc;

/// Creates the octrees of a map's tiles, and owns their shared state: the worker thread, if there is one, and the
/// counts.
///
/// The default creates views of the tables' bricks.
#[derive(Debug, Default)]
pub struct OctreeFactory {
    config: OctreeConfig,
    ledger: Arc<OctreeLedger>,
    worker: Option<OctreeWorker>,
}

/// Capacity of the worker's queue in voxels: 4 MiB.
const QUEUE_VOXELS: u64 = 1 << 18;

impl OctreeFactory {
    /// Creates a factory for octrees of this form.
    ///
    /// With [`VoxelCacheMode::Parallel`] it starts a thread, which ends with the factory. If the system cannot start a
    /// thread, the mapping threads write the octrees.
    pub fn new(config: OctreeConfig) -> Self {
        Self::with_queue(config, QUEUE_VOXELS)
    }

    pub(crate) fn with_queue(config: OctreeConfig, limit_voxels: u64) -> Self {
        let ledger = Arc::new(OctreeLedger::default());
        let worker = match config {
            OctreeConfig::Pointers(VoxelCacheMode::Parallel(_)) => {
                let worker = OctreeWorker::start(limit_voxels, ledger.clone());
                worker
                    .map_err(|error| log::warn!("no thread for octrees, so updates take longer: {error}"))
                    .ok()
            }
            _ => None,
        };
        Self { config, ledger, worker }
    }

    /// Statistics of all octrees created here, including dropped ones.
    pub fn statistics(&self) -> OctreeStatistics {
        let queue = self.worker.as_ref().map(|worker| worker.queue().counts()).unwrap_or_default();
        OctreeStatistics { queue, ..self.ledger.sum() }
    }

    pub(crate) fn octree_of(&self, table: &mut Table) -> TileOctree {
        match self.config {
            OctreeConfig::Bricks => {
                let mut octree = BrickOctree::default();
                octree.sync(table);
                TileOctree::Bricks(octree)
            }
            OctreeConfig::Pointers(mode) => {
                let cache = mode.cache().map(|config| VoxelCache::new(config.tau, config.buckets));
                let queue = self.worker.as_ref().map(|worker| worker.queue().clone());
                let writer = TreeWriter { queue, ledger: self.ledger.clone() };
                TileOctree::Pointers(Box::new(PointerOctree::of_table(cache, table, writer)))
            }
        }
    }

    #[cfg(test)]
    pub(crate) fn worker(&self) -> &OctreeWorker {
        self.worker.as_ref().expect("a parallel factory")
    }
}
