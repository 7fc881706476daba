//! A tile's exact table in compact form: for unused tiles in memory, and for files.
//!
//! ```text
//! header   36 bytes   magic "VXTC", version, voxels, bricks, states of the codebook, groups, length and CRC of the
//!                     codebook
//! index    16 bytes   per group: its first brick, length and CRC
//! codebook            the states that several voxels are in
//! groups              some bricks each: their codes, their masks, a symbol a voxel, and what symbols stand for
//! CRC-32    4 bytes
//! ```
//!
//! Data are columns, each compressed by zstd if that makes it smaller. The bytes depend on the table's content alone:
//! bricks in Morton order, states numbered by how many voxels are in them. Whoever has header, index and codebook can
//! check and read one group without the others ([`CompactIndex`]). Version 1 had no index; it is read and not written.
//! The byte tables are in `docs/format.md`.

mod codebook;
mod codebook_states;
mod column_reader;
mod column_writer;
mod columns;
mod compact_index;
mod effort;
mod group;
mod group_columns;
mod group_index;
mod group_reader;
mod group_sieve;
mod head;
mod header;
mod input;
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
pub(super) use reader::sift_compact;
pub use reader::{CompactReader, read_compact};
pub use writer::{CompactWriter, write_compact};

/// "VXTC", little-endian.
const MAGIC: u32 = 0x4354_5856;
const VERSION: u32 = 2;
/// Length of the checksum at the end.
pub(super) const CRC_BYTES: u64 = 4;
