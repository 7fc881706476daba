//! Compact form of a tile's exact table, used for files and for tiles in memory that are not in use.
//!
//! ```text
//! header   36 bytes   magic "VXTC", version, voxels, bricks, states of the codebook, groups, length and CRC of the
//!                     codebook
//! index    16 bytes   per group: its first brick, length and CRC
//! codebook            states that occur in several voxels
//! groups              some bricks each: their codes, their masks, one symbol per voxel, and data of symbols
//! CRC-32    4 bytes
//! ```
//!
//! Data are columns, each compressed by zstd if that makes it smaller. The bytes depend only on the content of the
//! table: bricks are in Morton order, and states are numbered by frequency. With header, index and codebook, a single
//! group can be checked and read ([`CompactIndex`]). Version 1 has no index; it can be read but is not written.
//! `docs/format.md` has the byte tables.

mod codebook;
mod codebook_states;
mod column_reader;
mod column_writer;
mod columns;
mod compact_index;
mod effort;
mod group;
mod group_columns;
mod group_filter;
mod group_index;
mod group_reader;
mod head;
mod header;
mod input;
mod layer_section;
mod numbers;
mod open_brick;
mod reader;
mod state_counts;
mod symbol;
mod table_builder;
#[cfg(test)]
mod tests;
mod voxel_finder;
mod writer;

pub(super) use compact_index::CompactIndex;
pub use effort::CompactEffort;
pub(super) use group_index::joined_crc;
pub use layer_section::read_layer_section;
pub(super) use reader::filter_compact;
pub use reader::{CompactReader, read_compact};
pub use writer::{CompactWriter, write_compact};

/// "VXTC", little-endian.
const MAGIC: u32 = 0x4354_5856;
const VERSION: u32 = 2;
/// Size of the checksum at the end.
pub(super) const CRC_BYTES: u64 = 4;
