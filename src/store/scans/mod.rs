//! Which scans a map was built from: number, time and origin of each, in `scans.bin`.
//!
//! ```text
//! header  magic, version
//! record  scan    flush, number, time stamp, origin, checksum
//!         rewind  flush, number of an earlier one: the map was reverted to it, and its list of scans, too
//! ```
//!
//! Records are synced before the commit that they belong to. One of a later flush than the last commit was left behind
//! by a crash: readers pass over it, and the next writer cuts it off.

mod catalog;
mod catalog_entry;
mod catalog_salvage;
mod catalog_version;
mod needed_scans;
mod scan_archive;
mod scan_list;
mod scan_record;
mod segment;

pub(crate) use catalog::{KeptAsOf, KeptRecords, catalog_generations, whole_fronts};
pub use catalog_entry::{CatalogEntry, KeptFrame, KeptRecord, SegmentPlace};
pub(crate) use catalog_salvage::{Salvaged, salvage_entries};
pub use catalog_version::CatalogVersion;
pub(crate) use needed_scans::{check_segment, kept_as_of};
pub(super) use scan_archive::Catalog;
pub use scan_archive::ScanArchive;
pub(super) use scan_list::ScanList;
pub(crate) use scan_list::{check_scans, read_scans};
pub use scan_record::ScanRecord;
pub(crate) use segment::{MAX_BLOCK_BYTES, SegmentReader};
