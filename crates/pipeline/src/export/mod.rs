//! Export of maps to the formats of other programs.
//!
//! ```text
//! ExportOptions -> export: format, checked options        options, run
//!   voxels, one stream of bytes                           stream   (moved_file, origin, origin_file)
//!   an octree                                             octree   (the same)
//!   voxels with companion files                           files
//!   3D Tiles                                              tileset
//! -> ExportSummary                                        summary
//! export_scans: the scans that a map keeps                scans
//! ```
//!
//! The formats are those of `voxtile_formats::write`. `chosen` selects the voxels for all of them.

mod chosen;
mod files;
mod moved_file;
mod octree;
mod options;
mod origin;
mod origin_file;
mod run;
mod scans;
mod stream;
mod summary;
#[cfg(test)]
mod tests;
mod tileset;

pub use options::{ExportOptions, WhichVoxels};
pub use run::export;
pub use scans::{ExportedScans, POSES_NAME, WhichPoints, export_scans};
pub use summary::{ExportSummary, Written};
