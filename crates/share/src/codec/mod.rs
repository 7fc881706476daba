//! Packets: voxels to bytes and back. Knows no transport, and no state but that of the present packet.
//!
//! ```text
//! updates -> octree, level by level -> bits with their contexts -> arithmetic coder -> bytes
//!            voxel_tree                context, prior              bit_coder          packet, request
//! ```
//!
//! Each packet can be decoded by itself, so a lost packet costs only its own content. Input is untrusted: no number in
//! a packet sets the size of an allocation, and the number of voxels is limited.

mod bit_coder;
mod bytes;
mod context;
mod neighbors;
mod packet;
mod prior;
mod request;
mod voxel_tree;

pub use context::CONTEXTS;
pub use packet::{DigestEntry, Header, Packet, Status, VERSION};
pub use prior::count_contexts;
pub use request::{MAX_LISTED, Request};
pub use voxel_tree::{Update, decode_updates, encode_updates};

/// Most voxels in a packet; more are refused. A packet of 1200 bytes could encode far more.
pub const MAX_VOXELS_PER_PACKET: usize = 1 << 14;
