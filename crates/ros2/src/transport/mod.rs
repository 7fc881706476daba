//! Transport of messages: DDS, or Zenoh compatible with `rmw_zenoh_cpp`. Other modules do not depend on the choice.
//!
//! ```text
//! Transport: subscribe (receives CDR bytes), advertise -> Sender, serve (requests to responses)
//! dds: rustdds, ros2-client      zenoh: a session, keys and tokens of rmw_zenoh
//! ```

mod dds;
mod graph;
mod message;
mod qos;
mod sender;
mod threads;
mod transport_name;
mod transport_node;
mod type_name;
#[cfg(feature = "zenoh")]
mod zenoh;

pub use graph::{Graph, Published};
pub use message::{Gid, Message};
pub use qos::Qos;
pub use sender::Sender;
pub use threads::spawn;
pub use transport_name::TransportName;
pub use transport_node::Transport;
pub use type_name::TypeName;

/// Callback for received messages.
pub type Put = Box<dyn Fn(Message) + Send>;
