//! Scans whose updates exceed the memory limit.
//!
//! Collectors that are full drain to [`ScanParts`], whose older half is an unnamed file. At the end the parts of each
//! tile are merged; updates that still exceed the limit go to the caller ([`Overflow`]).

mod overflow;
mod part_log;
mod scan_parts;

pub(crate) use overflow::Overflow;
pub(crate) use scan_parts::ScanParts;
