//! Zenoh as used by `rmw_zenoh_cpp`: one session, a key for each topic and service, and a liveliness token for the node
//! and each of its endpoints, from which other nodes derive the graph.
//!
//! ```text
//! sample, query -> Mailbox (bounded) -> a thread of its own -> CDR -> node
//! node -> CDR and attachment -> ZenohSender -> Subscribers: tokens of subscriptions
//! ```

mod attachment;
mod cdr;
mod configuration;
mod graph_name;
mod mailbox;
mod service;
mod subscribers;
mod type_hash;
mod zenoh_graph;
mod zenoh_node;
mod zenoh_sender;

pub use zenoh_graph::ZenohGraph;
pub use zenoh_node::ZenohNode;
pub use zenoh_sender::ZenohSender;
