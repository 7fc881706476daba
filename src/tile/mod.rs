//! A tile: three stores, one truth.
//!
//! ```text
//! updates -> Table (exact, the truth) -> VoxelCache (accumulated values) -> Octree (coarse answers, octree.bt)
//! ```
//!
//! The table answers every question about a finest voxel. The octree is derived from it and serves coarse
//! questions; the voxel cache in front keeps it from seeing every update (OctoCache). [`mod@format`] turns a tile
//! into the bytes of its two files and back; nothing here knows a path.

mod brick;
mod cached_octree;
mod cells;
pub mod format;
mod palette;
mod table;
mod tile_body;
mod voxel_cache;

pub use cached_octree::CachedOctree;
pub use table::Table;
pub use tile_body::{Tile, TileCounts, Voxel};
pub use voxel_cache::{VoxelCache, VoxelCacheCounts};

#[cfg(test)]
mod tests;
