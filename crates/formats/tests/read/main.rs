//! Tests of reading files of other programs.

/// Colours and classes of points.
mod attributes;
/// Colours and classes of LAS files, and selected points.
#[cfg(feature = "las")]
mod attributes_las;
/// Coordinate reference systems.
#[cfg(all(feature = "las", feature = "e57"))]
mod crs;
/// Generated depth images.
mod depth;
/// Motion compensation.
mod deskew;
#[cfg(feature = "e57")]
mod e57;
/// Detection of formats.
mod formats;
#[cfg(feature = "las")]
mod las;
/// Point counts of LAS files.
#[cfg(feature = "las")]
mod las_counts;
/// Units of LAS files.
#[cfg(feature = "las")]
mod las_units;
/// Checks of compressed points.
#[cfg(feature = "las")]
mod laz_chunks;
#[path = "../made/mod.rs"]
mod made;
/// Files that deviate from their format or name.
mod mistakes;
/// PLY, text and raw floats.
mod plain;
/// Pose files.
mod poses;
/// The registry of formats.
mod registry;
mod support;
