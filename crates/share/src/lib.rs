//! Sharing of maps between robots: one robot's occupied voxels reach the others exactly, even over a lossy link.
//!
//! A sender holds a set of voxels: the occupied voxels of its map or local map. A receiver keeps a copy of the set per
//! robot, called a layer. Packets may be lost, delayed, duplicated or reordered; the layer still converges to the
//! sender's set. The method follows La, Kang and Lee, "A robust, task-agnostic and fully-scalable voxel mapping system
//! for large scale environments", section V-C, which sends only newly occupied voxels. `docs/sharing.md` specifies the
//! protocol and the packet format.
//!
//! ```text
//! mapper -> MapWatch -> Sender: buffer, frames, ring -> packets -> Receiver -> VoxelSet (a layer) -> query::United, merge
//!                              ^                                     |
//!                              +---- requests: status, missing, digests, content <----+
//! ```
//!
//! The crate needs neither a transport nor a clock: packets are bytes, and the caller passes the current time.
//!
//! ```
//! use std::time::Duration;
//! use voxtile_share::{Receiver, ReceiverConfig, Sender, SenderConfig};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let grid = voxtile::space::Grid::new(0.1, 10.0)?;
//! let mut sender = Sender::new(grid, 1, SenderConfig::default())?;
//! let mut receiver = Receiver::new(ReceiverConfig::default());
//! sender.put([4, 5, 6], true);
//! for step in 1..10 {
//!     let now = Duration::from_secs(step);
//!     for packet in sender.poll(now) {
//!         receiver.take(&packet.bytes, now)?;
//!     }
//!     for request in receiver.poll(now) {
//!         for packet in sender.answer(7, &request, now)? {
//!             receiver.take(&packet.bytes, now)?;
//!         }
//!     }
//! }
//! assert!(receiver.layer().is_some_and(|layer| layer.contains([4, 5, 6])));
//! assert!(receiver.is_converged());
//! # Ok(())
//! # }
//! ```

mod answers;
mod anti_entropy;
pub mod codec;
mod differences;
mod interval_set;
mod layer_file;
mod layer_limits;
mod layer_merge;
mod local_rays;
mod nonce;
mod policy;
mod range_versions;
mod receiver;
mod receiver_config;
mod receiver_memory;
mod receivers;
mod replace;
mod ring;
mod scan_tiles;
mod send_buffer;
mod sender;
mod sender_config;
mod set;
mod set_memory;
mod set_queries;
mod set_range;
mod stream;
mod token_bucket;
mod voxel_versions;
mod watch;

pub use layer_file::{read_layer, read_layer_within, write_layer};
pub use layer_merge::{LayerMergeReport, merge_layer};
pub use policy::ExportPolicy;
pub use receiver::Receiver;
pub use receiver_config::{ReceiverConfig, ReceiverCounts};
pub use receivers::Receivers;
pub use sender::{Outgoing, ReceiverId, Sender};
pub use sender_config::{SenderConfig, SenderCounts};
pub use set::VoxelSet;
pub use set_range::{SetPosition, SetRange};
pub use watch::{LocalWatch, MapWatch};
