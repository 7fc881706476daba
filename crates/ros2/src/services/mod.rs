//! Services. Those that change the map are orders to the mapping thread; the others query views concurrently.
//!
//! ```text
//! request -> Transport -> orders -> Mapping -> Outcome
//!                      -> octomaps, queries, esdf -> LiveMap
//! ```

mod esdf;
mod octomaps;
mod order;
mod orders;
mod queries;
mod rmw;
mod start;

pub use order::Order;
pub use orders::{Orders, PlacedOrder, orders};
pub use rmw::Rmw;
pub use start::start;
