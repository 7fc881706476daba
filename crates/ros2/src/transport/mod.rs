//! How the node talks to others: over DDS, or over Zenoh as `rmw_zenoh_cpp` does. Nothing else knows which of the two.
//!
//! ```text
//! Transport: subscribe (bytes of CDR come), advertise -> Sender, serve (requests to responses)
//! dds: rustdds, ros2-client      zenoh: a session, keys and tokens of rmw_zenoh
//! ```

mod dds;
mod message;
mod qos;
mod sender;
mod threads;
mod transport_name;
mod transport_node;
mod type_name;
#[cfg(feature = "zenoh")]
mod zenoh;

pub use message::{Gid, Message};
pub use qos::Qos;
pub use sender::Sender;
pub use transport_name::TransportName;
pub use transport_node::Transport;
pub use type_name::TypeName;

/// Takes a message.
pub type Put = Box<dyn Fn(Message) + Send>;
