//! What is done with whole maps on disk, tile by tile in constant memory.
//!
//! ```text
//! tables, in tile order -> MapWriter -> MAP.unfinished -> MAP
//! ```

mod map_writer;

pub use map_writer::{MapWriter, WrittenMap};
