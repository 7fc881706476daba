//! Files of other programs, read.

/// Coordinate systems on their way through.
#[cfg(all(feature = "las", feature = "e57"))]
mod crs;
/// Depth images that the test makes.
mod depth;
/// Points of a scanner in motion.
mod deskew;
#[cfg(feature = "e57")]
mod e57;
/// What a file or a folder is.
mod formats;
#[cfg(feature = "las")]
mod las;
/// How many points a LAS file has.
#[cfg(feature = "las")]
mod las_counts;
/// In what a LAS file measures.
#[cfg(feature = "las")]
mod las_units;
/// What is promised of compressed points.
#[cfg(feature = "las")]
mod laz_chunks;
#[path = "../made/mod.rs"]
mod made;
/// What people have that is not quite what its name says.
mod mistakes;
/// PLY, text and raw floats.
mod plain;
/// Files of poses.
mod poses;
/// The formats that there are.
mod registry;
mod support;
