//! Maps in a browser: an HTTP server, and the page that it serves.
//!
//! ```text
//! request -> server    timeouts, threads                            server, work
//!                      connections, and how many a client has       connections, client_stream
//!                      what answers that are being sent hold        answer_memory
//!         -> Route     what a path asks for, or nothing             route, token
//!         -> answers   JSON of a query, a tileset, bytes of a node  answers
//!            ServedMap one map, followed while somebody writes it   served_map
//!            MapState  one state of it: a flush, a snapshot         map_state, node_cache
//! ```
//!
//! The page is `page/dist`, made by `page/bundle.sh`. docs/view.md has the interface.

mod answer_memory;
mod answers;
mod client_stream;
mod connections;
mod map_state;
mod node_cache;
mod page;
mod response;
mod route;
mod served_map;
mod server;
mod token;
mod view;
mod work;

pub use view::{Progress, View, ViewOptions};
