//! Encoding and decoding of packets. A packet is independent of other packets.
//!
//! ```text
//! updates -> octree, level by level -> bits with their contexts -> arithmetic coder -> bytes
//!            voxel_tree                context, prior              bit_coder          packet, request
//! ```
//!
//! A lost packet costs only its own content. Input is untrusted: no number in a packet sets the size of an allocation,
//! and the number of voxels is limited.

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

/// Maximum number of voxels in a packet; packets with more are refused. A packet of 1200 bytes could encode far more.
pub const MAX_VOXELS_PER_PACKET: usize = 1 << 14;
