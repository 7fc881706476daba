//! Conversion of tiles and configurations to files and back: the only layer that uses both tiles and the store.
//!
//! ```text
//! load          store -> table, checked against the log -> Tile
//! one_voxel     store -> the evidence of one voxel, from a part of its tile's file
//! tile_saver    Tile or CompactTile -> table and octree files -> store
//! copy_tile     a tile of one map -> another map's store, with that map's id
//! compact_tile  a tile in the compact form, in memory; encoded by packer
//! io_threads    one saving and one loading thread, each a `Worker`
//! point_reader  store -> the points of a kept scan, and the marks of those that moved
//! priority      lower priority for background threads
//! upgrade       a map of the original format -> the same map with id, log and checksums
//! parameters    MapConfig <-> metadata.json; map_id creates ids
//! ```

mod compact_tile;
mod copy_tile;
mod io_threads;
pub(crate) mod load;
mod map_id;
pub(crate) mod one_voxel;
mod packer;
mod parameters;
mod point_reader;
mod priority;
mod tile_saver;
mod upgrade;
mod worker;

pub(crate) use compact_tile::CompactTile;
pub(crate) use copy_tile::copy_tile;
pub(crate) use io_threads::{IoThreads, Loaded, Saved};
pub(crate) use map_id::new_map_id;
pub(crate) use packer::Packer;
pub(crate) use parameters::{config_from, new_metadata};
pub(crate) use point_reader::{PointReader, check_points, read_marks};
pub(crate) use priority::lower_priority;
pub(crate) use tile_saver::TileSaver;
pub(crate) use upgrade::upgrade;
pub(crate) use worker::Worker;
