//! Map sharing: what one robot finds occupied, at the others, exactly.
//!
//! A sender has a set of voxels, those of its archive or local map that are occupied. A receiver keeps a layer for each
//! robot it hears, and after whatever was lost, late, repeated or out of order the layer equals the sender's set.
//! After La, Kang and Lee, "A robust, task-agnostic and fully-scalable voxel mapping system for large scale environments",
//! section V-C, which sends newly occupied voxels and stops there; `docs/sharing.md` has the protocol and its bytes.
//!
//! ```text
//! mapper -> MapWatch -> Sender: pending, frames, ring -> packets -> Receiver -> VoxelSet (a layer) -> WithLayers, fold
//!                              ^                                     |
//!                              +---- asks: status, missing, digests, content <----+
//! ```
//!
//! Nothing here knows a transport or a clock: packets are bytes, times are handed in.
//!
//! ```
//! use std::time::Duration;
//! use voxtile::share::{Receiver, ReceiverConfig, Sender, SenderConfig};
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
//!     for ask in receiver.poll(now) {
//!         for packet in sender.answer(7, &ask, now)? {
//!             receiver.take(&packet.bytes, now)?;
//!         }
//!     }
//! }
//! assert!(receiver.layer().is_some_and(|layer| layer.contains([4, 5, 6])));
//! assert!(receiver.is_converged());
//! # Ok(())
//! # }
//! ```

mod allowance;
mod answers;
mod catch_up;
pub mod codec;
mod differences;
mod fold;
mod layer_file;
mod layer_limits;
mod nonce;
mod part_stamps;
mod parts;
mod pending;
mod policy;
mod receiver;
mod receiver_config;
mod receiver_memory;
mod receivers;
mod replace;
mod ring;
mod sender;
mod sender_config;
mod set;
mod set_memory;
mod set_range;
mod stamps;
mod stream;
mod union;
mod watch;

pub use fold::{FoldReport, fold_layer};
pub use layer_file::{read_layer, read_layer_within, write_layer};
pub use policy::ExportPolicy;
pub use receiver::Receiver;
pub use receiver_config::{ReceiverConfig, ReceiverCounts};
pub use receivers::Receivers;
pub use sender::{Outgoing, ReceiverId, Sender};
pub use sender_config::{SenderConfig, SenderCounts};
pub use set::VoxelSet;
pub use set_range::{SetPosition, SetRange};
pub use union::WithLayers;
pub use watch::{LocalWatch, MapWatch};
