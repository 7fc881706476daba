//! Services: what changes the map is an order to the mapping thread, the others ask views beside it.
//!
//! ```text
//! request -> Transport -> orders -> Mapping -> Outcome
//!                      -> octomaps, queries -> LiveMap
//! ```

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
