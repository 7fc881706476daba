//! Fields in folders: one file per tile of the map, computed in boxes that fit in memory.
//!
//! ```text
//! tiles of the map -> wanted tiles and their keys                  wanted, tile_key
//!   -> those whose file exists are kept
//!   -> boxes of tiles, read with their surroundings                 boxes, tile_cache
//!   -> Solver -> one file per tile                                  compute, tile_file
//!   -> field.json, which makes them the field                       index
//! FieldReader <- files, an LRU of tiles                             reader
//! all files                                                        field_folder, field_disk
//! ```
//!
//! The name of a tile's file has its key, a hash of the parameters and of the versions of all tiles within the cap. So a
//! new field never replaces files of the old one: `field.json` is the only commit point, and files of a killed run are
//! used by the next one.

mod boxes;
mod compute;
mod damage;
#[cfg(test)]
mod fault_tests;
mod field_disk;
mod field_folder;
mod index;
mod reader;
mod tile_cache;
mod tile_file;
mod tile_key;
mod wanted;

pub use compute::{FieldOptions, FieldReport, compute_field};
pub use reader::FieldReader;
