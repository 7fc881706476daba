//! What is done with whole maps on disk, tile by tile in constant memory.
//!
//! ```text
//! tables, in tile order -> MapWriter -> MAP.unfinished -> MAP
//! ```

mod convert;
mod map_writer;

pub use convert::convert;
pub use map_writer::{MapWriter, WrittenMap};
