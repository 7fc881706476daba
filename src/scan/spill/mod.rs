//! Spilling of scans whose updates exceed the memory limit.
//!
//! Full collectors drain to [`ScanParts`], whose older part is in an unnamed file. At the end the parts of each tile
//! are merged; updates that still exceed the limit are passed to the caller ([`Overflow`]).

mod overflow;
mod part_log;
mod scan_parts;

pub(crate) use overflow::Overflow;
pub(crate) use scan_parts::ScanParts;
