//! A tile: three stores, one truth.
//!
//! ```text
//! updates -> Table (exact, the truth) -> octree (coarse answers, octree.bt)
//! ```
//!
//! The table answers every question about a finest voxel. The octree is derived from it and serves coarse
//! questions. It is a view of the table's bricks, or a tree of its own: written at once, or behind a voxel cache that
//! keeps it from seeing every update (OctoCache), or by another thread at that. [`mod@format`] turns a tile into the bytes of its two files and back;
//! nothing here knows a path.

mod brick;
mod brick_directory;
mod brick_octree;
mod brick_update;
mod cells;
pub mod format;
mod miss_runs;
mod octree_factory;
mod octree_statistics;
mod octree_worker;
mod packed;
mod palette;
mod pointer_octree;
mod shared_tree;
mod summary;
mod table;
mod table_update;
mod tile_body;
mod tile_octree;
mod update_stream;
mod voxel_cache;
mod work_queue;

pub use octree_factory::OctreeFactory;
pub use octree_statistics::{OctreeQueueCounts, OctreeStatistics, OctreeTimes};
pub use table::Table;
pub use tile_body::{Tile, TileCounts, Voxel};
pub use voxel_cache::{VoxelCache, VoxelCacheCounts};

#[cfg(test)]
mod octree_tests;
#[cfg(test)]
mod tests;
