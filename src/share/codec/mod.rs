//! Packets: voxels to bytes and back. Knows no transport and no state but that of the packet at hand.
//!
//! ```text
//! updates -> octree, level by level -> bits with their contexts -> arithmetic coder -> bytes
//!            voxel_tree                context, prior              bit_coder          packet, ask
//! ```
//!
//! Every packet can be read by itself, so that a lost one costs only itself. What is read is hostile until shown otherwise:
//! nothing is allocated by a number from a packet, and there is a limit on voxels.

mod ask;
mod bit_coder;
mod bytes;
mod context;
mod neighbors;
mod packet;
mod prior;
mod voxel_tree;

pub use ask::{Ask, MAX_LISTED};
pub use context::CONTEXTS;
pub use packet::{DigestEntry, Header, Packet, Status, VERSION};
pub use prior::count_contexts;
pub use voxel_tree::{Update, decode_updates, encode_updates};

/// Most voxels in a packet; more are refused. What a packet of 1200 bytes can stand for is far more.
pub const MAX_VOXELS_PER_PACKET: usize = 1 << 14;
