//! Scans of a map: number, time and origin of each in `scans.bin`; points of kept scans in `kept_scans/`.
//!
//! ```text
//! header  magic, version
//! record  scan    flush, number, time stamp, origin, checksum
//!         rewind  flush, number of the earlier flush to which the map and its list of scans were reverted
//! ```
//!
//! Records are synced before their commit. Records of flushes after the last commit remain after a crash: readers
//! ignore them, and the next writer truncates the file.

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
pub use catalog_entry::{CatalogEntry, KeptFrame, KeptMarks, KeptRecord, SegmentPlace};
pub(crate) use catalog_salvage::{Salvaged, salvage_entries};
pub use catalog_version::CatalogVersion;
pub(crate) use needed_scans::{check_segment, kept_as_of};
pub(super) use scan_archive::Catalog;
pub use scan_archive::ScanArchive;
pub(super) use scan_list::ScanList;
pub(crate) use scan_list::{check_scans, read_scans};
pub use scan_record::ScanRecord;
pub(crate) use segment::{MAX_BLOCK_BYTES, SegmentReader};
