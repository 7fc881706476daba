//! OctoMap's octree over voxel keys, and OctoMap's files.
//!
//! ```text
//! Octree       16 levels below the root, f32 log-odds, pruned at once     tree, block, leaves, overrides
//! read, write  `.bt` (occupied / free) and `.ot` (all values), by bytes   codec, brick_nodes
//! ```
//!
//! A tree knows neither metres nor tiles: a voxel is its [`MortonCode`](crate::space::MortonCode). A file adds
//! one length, the resolution.

mod block;
mod brick_nodes;
mod codec;
mod leaves;
mod overrides;
mod tree;

pub use brick_nodes::BrickNodes;
pub use codec::{
    OCTOMAP_MAX_LOG_ODDS, OCTOMAP_MIN_LOG_ODDS, OctreeFile, OctreeFormat, read, read_bt, read_ot,
    read_with_limit, write_bt, write_bt_of_bricks, write_bt_unpruned, write_ot,
};
pub use leaves::{Leaf, Leaves};
pub use tree::{Octree, VoxelCounts};

#[cfg(test)]
mod tests;
