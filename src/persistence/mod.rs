//! Tiles and configurations to their files and back. This layer alone knows both what a tile holds and how the store keeps
//! it; mappers, map operations and integrity checks stand on it.
//!
//! ```text
//! load        store -> table, checked against the log -> Tile
//! TileSaver   Tile or CompactTile -> table and octree files -> store
//! IoThreads   one thread that saves, one that prefetches; both through the two above
//! upgrade     a map of the seed's format -> the same map with an id, a log and checksums
//! parameters  MapConfig <-> metadata.json
//! ```

mod compact_tile;
mod io_threads;
pub(crate) mod load;
mod map_id;
mod parameters;
mod tile_saver;
mod upgrade;
mod worker;

pub(crate) use compact_tile::CompactTile;
pub(crate) use io_threads::{IoThreads, Loaded, Saved};
pub(crate) use map_id::new_map_id;
pub(crate) use parameters::{config_from, new_metadata};
pub(crate) use tile_saver::TileSaver;
pub(crate) use upgrade::upgrade;
