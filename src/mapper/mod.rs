//! Maps: two mappers with one trait and identical answers, and a reader that may be used while a writer is active.
//!
//! | | [`InMemoryMapper`] | [`OutOfCoreTileMapper`] | [`MapReader`] |
//! |---|---|---|---|
//! | storage | memory | disk, and an LRU of tiles in memory | disk, and an LRU of tiles in memory |
//! | map size | bounded by memory | bounded by the disk | bounded by the disk |
//! | writes | yes | yes, one at a time | never |
//!
//! ```text
//! insert_points -> scan::trace -> updates by tile -> paging: resident tiles, write buffer -> persistence -> store
//! ```
//!
//! [`OctreeMap`] makes an OctoMap file queryable as a map.
//!
//! `paging` moves tiles between memory and disk.

mod in_memory;
mod kept_scan;
mod kept_scans;
mod kept_summary;
mod live;
mod map_reader;
mod octree_map;
mod options;
mod out_of_core;
mod paging;
mod remapper;
mod shadow_mapper;
mod statistics;
mod stoppable;
mod tile_finder;
mod tile_map;
mod tile_ref;
mod trace_rules;
mod traits;

pub use in_memory::InMemoryMapper;
pub use kept_scan::{KeptScan, NewPose};
pub use kept_scans::KeptScans;
pub(crate) use kept_summary::no_kept_scan;
pub use kept_summary::{KeptScanHead, KeptSummary};
pub use live::{LiveReader, LiveView};
pub use map_reader::MapReader;
pub use octree_map::OctreeMap;
pub use options::MapOptions;
pub use out_of_core::OutOfCoreTileMapper;
pub(crate) use remapper::Remapper;
pub(crate) use shadow_mapper::ShadowMapper;
pub use statistics::{IoCounts, MapStatistics, MemoryCounts, StallCounts};
pub use stoppable::Stoppable;
pub(crate) use tile_finder::TileFinder;
pub use tile_ref::TileRef;
pub use traits::{MapView, Mapper};
