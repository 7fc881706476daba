//! OctoMap's pointer tree with the cache of OctoCache (Chen et al., ASPLOS 2025).
//!
//! ```text
//! updates -> table -> VoxelCache -evicted voxels-> WorkQueue -> OctreeWorker, a thread -> SharedTree
//!                 \___ cache off ___________________________________________________/
//! ```
//!
//! Queries combine the tree with the cache and with the pending batches. If any of these is lost, it is rebuilt from
//! the table.

mod octree_statistics;
mod octree_worker;
mod pointer_octree;
mod shared_tree;
#[cfg(test)]
mod tests;
mod update_stream;
mod voxel_cache;
mod work_queue;

pub(crate) use octree_statistics::OctreeLedger;
pub use octree_statistics::{OctreeQueueCounts, OctreeStatistics, OctreeTimes};
pub(crate) use octree_worker::OctreeWorker;
pub(crate) use pointer_octree::{PointerOctree, TreeWriter};
pub use voxel_cache::{VoxelCache, VoxelCacheCounts};
