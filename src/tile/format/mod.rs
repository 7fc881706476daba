//! Files of a tile's exact table: `iwlo_meta.bin`, written and read as a stream.
//!
//! ```text
//! header   16 bytes   magic "IWLO", version 1, count
//! entries  18 bytes   each: key 3 x u16, log-odds f64, observation count i32, in Morton order
//! trailer  72 bytes   magic, version, map id, tile index, scan number, checksums
//! text                parameters of the map
//! ```
//!
//! All numbers are little-endian. A reader of version 1 stops after `count` entries and ignores the trailer.
//! `docs/format.md` has the byte tables. With compact storage the same table is written as `tile.vxt`, see
//! `compact_file.rs`.

mod any_order_entries;
mod ascending_entries;
mod compact;
mod compact_file;
mod entries;
mod entry;
mod gather;
mod reader;
mod renewed;
mod trailer;
mod writer;

pub use compact::read_layer_section;
pub use compact::{CompactEffort, CompactReader, CompactWriter, read_compact, write_compact};
pub use compact_file::{
    CompactFileIndex, read_compact_file, read_compact_front, read_compact_voxels_from, write_compact_file,
};
pub use entries::encode_entries;
pub use gather::FilteredVoxels;
pub use reader::{Decoded, DecodedTable, read_table, read_trailer, read_voxels_from};
pub use renewed::{renew_compact_file, renew_table};
pub use trailer::{TRAILER_BYTES, Trailer};
pub use writer::{TableChecksums, write_table};

/// "IWLO" as the original format writes it.
const MAGIC: u32 = 0x4957_4C4F;
const VERSION: u32 = 1;
const HEADER_BYTES: u64 = 16;
const ENTRY_BYTES: u64 = 18;
type EntryBytes = [u8; ENTRY_BYTES as usize];
