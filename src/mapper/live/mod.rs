//! The map beside its mapper: readers in other threads of the process see whole scans while the mapper goes on.
//!
//! ```text
//! LiveReader   a handle, one for each thread that asks; every query sees the map as of one scan
//!   LiveView     the map after one scan, for several queries that belong together
//!     ReadTiles    tiles that readers have made of what is in memory or on disk
//! ```
//!
//! What a view sees is kept in `paging::views`.

mod live_reader;
mod live_view;
mod read_tiles;

pub use live_reader::LiveReader;
pub use live_view::LiveView;
