//! Shows maps in a browser: an HTTP server and its page.
//!
//! ```text
//! request -> server    timeouts, threads                            server, work
//!                      connections and limits per client            connections, client_stream
//!                      memory of responses in flight                answer_memory
//!         -> Route     parsing of paths                             route, token
//!         -> answers   JSON of a query, a tileset, bytes of a node  answers
//!                      points of kept scans that are marked         moving
//!                      distances of a layer of voxels               distance_slice
//!                      ceiling and range of heights                 overview
//!         -> metrics   text for Prometheus                          view_metrics
//!            ServedMap one map that another process may write       served_map
//!            comparison  classes of the voxels of two maps      comparison
//!            MapState  one state of it: a flush or a snapshot       map_state, node_cache
//! export_page   a folder with the page, for static web servers
//! ```
//!
//! The page is `page/dist`, built by `page/bundle.sh`. docs/view.md describes the HTTP interface.

mod answer_memory;
mod answers;
mod client_stream;
mod comparison;
mod connections;
mod distance_slice;
mod export_page;
mod map_state;
mod moving;
mod node_cache;
mod overview;
mod page;
mod response;
mod route;
mod served_map;
mod server;
mod token;
mod view;
mod view_metrics;
mod work;

pub use export_page::{PageOptions, PageSummary, export_page};
pub use view::{CompareWith, Progress, View, ViewOptions};
