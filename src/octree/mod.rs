//! OctoMap's octree over voxel keys, and OctoMap's file formats.
//!
//! ```text
//! Octree       16 levels below the root, f32 log-odds, pruned immediately  tree, block, leaves, overrides
//! read, write  `.bt` (occupied / free) and `.ot` (all values) files        codec, brick_nodes, brick_values,
//!                                                                          node_colour
//! ```
//!
//! A tree is independent of metres and tiles: a voxel is its [`MortonCode`](crate::space::MortonCode). A file adds the
//! resolution.

mod block;
mod brick_nodes;
mod brick_values;
mod codec;
mod leaves;
mod node_colour;
mod overrides;
mod tree;

pub use brick_nodes::BrickNodes;
pub use brick_values::BrickValues;
pub use codec::{
    BtPruning, OCTOMAP_MAX_LOG_ODDS, OCTOMAP_MIN_LOG_ODDS, OctreeFile, OctreeFormat, OctreeStream,
    StreamOutcome, read, read_bt, read_ot, read_with_limit, write_bt, write_bt_of_bricks, write_bt_unpruned,
    write_ot,
};
pub use leaves::{Leaf, Leaves};
pub use node_colour::NodeColour;
pub use tree::{Octree, VoxelCounts};

#[cfg(test)]
mod tests;
