//! What is done with whole maps on disk, tile by tile in constant memory.
//!
//! ```text
//! tables, in tile order -> MapWriter -> MAP.unfinished -> MAP
//! merge   k readers, the tiles of one place at a time -> MapWriter
//! crop    one reader -> MapWriter
//! clear, decay   MapEditor: tiles read, changed, written beside -> one commit
//! ```
//!
//! What each is for, and its rules: `docs/life_of_a_map.md`.

mod clear;
mod convert;
mod crop;
mod decay;
mod map_editor;
mod map_writer;
mod merge;
mod merge_rule;
mod part;
mod table_change;
mod table_merge;

pub use clear::{Cleared, clear, clear_on};
pub use convert::convert;
pub use crop::{crop, crop_on};
pub use decay::{Decay, Decayed, decay, decay_on};
pub use map_writer::{MapWriter, WrittenMap};
pub use merge::{Merged, merge, merge_on};
pub use merge_rule::Prefer;
pub use part::Part;
