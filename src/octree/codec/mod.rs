//! OctoMap's file formats, reproduced byte for byte.
//!
//! A file is a text header, then the nodes in preorder: `.bt` has two bits per child (unknown, free leaf, occupied
//! leaf, inner node), `.ot` the log-odds of each node and a mask of its children. Any byte string decodes to a tree or
//! to an error; memory grows with the bytes that were read, never with a number in the file.

mod bt;
mod bt_bricks;
mod header;
mod input;
mod node_encoder;
mod number;
mod octree_file;
mod octree_stream;
mod ot;
mod ot_bricks;
mod spine;

pub use bt::{OCTOMAP_MAX_LOG_ODDS, OCTOMAP_MIN_LOG_ODDS, write_bt, write_bt_unpruned};
pub use bt_bricks::write_bt_of_bricks;
pub use octree_file::{OctreeFile, OctreeFormat, read, read_bt, read_ot, read_with_limit};
pub use octree_stream::{BtPruning, OctreeStream, StreamOutcome};
pub use ot::write_ot;
