//! The front door: two mappers, one trait, one answer; and a reader beside them.
//!
//! | | [`InMemoryMapper`] | [`OutOfCoreTileMapper`] | [`MapReader`] |
//! |---|---|---|---|
//! | storage | memory | disk, and an LRU of tiles in memory | disk, and an LRU of tiles in memory |
//! | map size | bounded by memory | bounded by the disk | bounded by the disk |
//! | writes | yes | yes, one at a time | never |
//!
//! ```text
//! insert_scan -> scan::trace -> updates by tile -> resident tiles, at once
//!                                               -> pending lists, for tiles that are not
//! make room   -> resident tiles -> cold tiles (in the compact form) -> store, on a thread of its own
//! look ahead  -> store, on a thread of its own -> resident tiles
//! flush       -> pending lists -> tiles -> store -> one commit
//! ```

pub(crate) mod adoption;
mod cold_tiles;
mod flush;
mod in_memory;
mod look_ahead;
mod map_id;
mod map_reader;
mod memory_plan;
mod out_of_core;
mod pending;
mod residency;
mod resident_tiles;
mod room;
mod side_worker;
mod stalls;
mod statistics;
pub(crate) mod tile_files;
mod tile_map;
mod tile_ref;
pub(crate) mod tile_saver;
mod tile_traffic;
mod trace;
mod traits;
mod waiting;

pub(crate) use flush::new_metadata;
pub use in_memory::InMemoryMapper;
pub(crate) use map_id::new_map_id;
pub use map_reader::MapReader;
pub(crate) use map_reader::config_from;
pub use out_of_core::OutOfCoreTileMapper;
pub use statistics::{IoCounts, MapStatistics, MemoryCounts, StallCounts};
pub use tile_ref::TileRef;
pub use traits::{MapView, Mapper};
