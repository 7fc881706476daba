//! OctoMap's octree, and its files.
//!
//! 16 levels over [Morton codes](crate::space::MortonCode), `f32` log-odds, an inner node is the maximum of its
//! children, eight equal leaf children are pruned into their parent. Knows no file and no metres.

mod bt_writer;
mod tree;

pub use bt_writer::write_bt;
pub use tree::{Leaf, Octree};
