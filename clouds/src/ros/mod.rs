//! Recordings of ROS 1 and ROS 2.

pub mod messages;
mod wire;

pub use wire::{Decoded, Wire, WireError, WireReader};
