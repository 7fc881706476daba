//! A tile: its exact table, its octree, and their files.
//!
//! ```text
//! updates -> table/ (exact evidence) -> octree/ (coarse queries), or octocache/ (OctoMap's tree, for comparison)
//!              \-> format/ (content of the tile's files)
//! hits    -> layers/ (sums over the points that hit a voxel)
//! ```
//!
//! The table answers all queries at voxel resolution. The octree is derived from it and answers coarse queries. Code in
//! this module does not access paths.

pub mod format;
mod layers;
mod octocache;
mod octree;
mod table;
mod tile_body;

pub use layers::{ClassVotes, ColourSums, IntensitySums, LayerTable, ShapeSums, TimeSpan, VoxelLayers};
pub use octocache::{OctreeQueueCounts, OctreeStatistics, OctreeTimes, VoxelCache, VoxelCacheCounts};
pub use octree::OctreeFactory;
pub use table::Table;
pub(crate) use table::{BrickView, MarkedBlock, VoxelBatch};
pub use tile_body::{Tile, TileCounts, Voxel};

#[cfg(test)]
mod tests;
