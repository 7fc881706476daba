//! Zenoh, as `rmw_zenoh_cpp` uses it: one session, a key for each topic and service, a liveliness token for the node
//! and each of its ends, by which others know the graph.
//!
//! ```text
//! sample, query -> Mailbox (bounded) -> a thread of its own -> CDR -> node
//! node -> CDR and attachment -> ZenohSender -> listeners: tokens of subscriptions
//! ```

mod attachment;
mod cdr;
mod configuration;
mod graph_name;
mod listeners;
mod mailbox;
mod service;
mod type_hash;
mod zenoh_node;
mod zenoh_sender;

pub use zenoh_node::ZenohNode;
pub use zenoh_sender::ZenohSender;
