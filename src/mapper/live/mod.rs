//! Live queries: readers in other threads of the process see the map as of one scan while the mapper continues.
//!
//! ```text
//!   LiveReader   a handle for each querying thread; each query sees the map as of one scan
//!     LiveView     the map as of one scan, for several queries about it
//!       ReadTiles    tiles that readers have built from memory or disk
//! ```
//!
//! `paging::views` keeps the data that views see.

mod live_reader;
mod live_view;
mod read_tiles;

pub use live_reader::LiveReader;
pub use live_view::LiveView;
