use super::voxel_cache::{VoxelCache, VoxelCacheCounts};
use crate::config::VoxelCacheConfig;
use crate::octree::Octree;
use crate::sensor::Evidence;
use crate::space::MortonCode;

/// The octree of a tile behind its voxel cache: what is asked of it is answered as if every update had gone
/// straight into the tree.
#[derive(Clone, Debug)]
pub struct CachedOctree {
    cache: VoxelCache,
    octree: Octree,
}

impl CachedOctree {
    /// The octree of the given voxels, in Morton order, behind an empty cache.
    pub fn from_voxels(
        config: &VoxelCacheConfig,
        voxels: impl Iterator<Item = (MortonCode, Evidence)>,
    ) -> Self {
        let octree = Octree::from_sorted(voxels.map(|(code, evidence)| (code, evidence.log_odds as f32)));
        Self { cache: VoxelCache::new(config.tau, config.buckets), octree }
    }

    /// Takes the new log-odds of an updated voxel.
    pub fn put(&mut self, code: MortonCode, log_odds: f64) {
        self.cache.put(code, log_odds as f32);
    }

    /// Ends a scan: what leaves the cache goes into the tree.
    pub fn end_scan(&mut self) {
        self.octree.write_sorted(&self.cache.evict());
    }

    /// Brings the tree up to date and returns it; the cache is empty afterwards.
    pub fn sync(&mut self) -> &Octree {
        if !self.cache.is_empty() {
            self.octree.write_sorted(&self.cache.drain());
        }
        &self.octree
    }

    /// The tree, brought up to date.
    pub fn into_octree(mut self) -> Octree {
        self.sync();
        self.octree
    }

    /// The tree, if no update is waiting in the cache.
    pub fn synced(&self) -> Option<&Octree> {
        self.cache.is_empty().then_some(&self.octree)
    }

    /// Largest log-odds of the voxels under the node at `depth` (1 to 16) that holds `code`; `None` if all are
    /// unknown.
    pub fn max_under(&self, code: MortonCode, depth: u8) -> Option<f32> {
        let first = code.ancestor(depth);
        let waiting = self.cache.under(first, MortonCode::span(depth));
        self.octree.max_with_overrides(first, depth, &waiting)
    }

    /// What the cache has seen.
    pub fn cache_counts(&self) -> VoxelCacheCounts {
        self.cache.counts()
    }

    /// Nodes of the tree, without what waits in the cache.
    pub fn node_count(&self) -> u64 {
        self.octree.node_count()
    }

    /// Bytes of memory on the heap: of the tree, and of the cache.
    pub fn bytes(&self) -> (usize, usize) {
        (self.octree.bytes(), self.cache.bytes())
    }
}
