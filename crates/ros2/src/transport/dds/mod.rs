//! DDS, by `rustdds` and `ros2-client`.

mod dds_node;
mod dds_sender;
mod marked;
mod raw_message;
mod servers;

pub use dds_node::{DdsGraph, DdsNode};
pub use dds_sender::DdsSender;
