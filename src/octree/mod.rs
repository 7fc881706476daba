//! OctoMap's octree, and its files.
//!
//! 16 levels over [Morton codes](crate::space::MortonCode), `f32` log-odds, an inner node is the maximum of its
//! children, eight equal leaf children are pruned into their parent. Knows no path and no metres but the resolution
//! that its files name.
//!
//! | file | holds | written by OctoMap's |
//! |---|---|---|
//! | `.bt` | free or occupied, two bits a node | `writeBinary` |
//! | `.ot` | log-odds of every node | `write` |

mod bt;
mod file;
mod header;
mod ot;
mod tree;

pub use bt::write_bt;
pub use file::{OctreeFile, OctreeFormat, read_octree};
pub use ot::write_ot;
pub use tree::{Leaf, Octree};

/// Log-odds of a leaf that a `.bt` file calls free: OctoMap's lower clamp, `logit(0.1192)` as `f32`.
pub const BT_FREE: f32 = f32::from_bits(0xc000_0075);
/// Log-odds of a leaf that a `.bt` file calls occupied: OctoMap's upper clamp, `logit(0.971)` as `f32`.
pub const BT_OCCUPIED: f32 = f32::from_bits(0x4060_b4ba);
