//! Writers of voxels for other programs, one format per file. `registry.rs` has the table of formats.
//!
//! ```text
//! OutputFormats -> OutputFormat::open(VoxelsHead, WriteOptions) -> VoxelSink <- sequence of VoxelRow, then finish
//! ```
//!
//! A sink writes to the given path; the caller renames the complete file. Data that cannot be written in voxel order is
//! sorted in unnamed files in the output's folder. Memory does not grow with the voxels, except for the 2D grids of
//! `nav2` and `heightmap`.

mod arrays;
mod autoware;
mod column_grid;
#[cfg(feature = "las")]
mod copc;
#[cfg(feature = "las")]
mod copc_levels;
mod counted;
mod csv;
#[cfg(feature = "e57")]
mod e57;
mod file_unit;
mod flat_map;
mod geotiff;
mod glb;
mod glb_json;
mod greedy;
mod height_range;
mod heightmap;
#[cfg(feature = "las")]
mod las;
#[cfg(feature = "las")]
mod las_layout;
mod lattice;
#[cfg(feature = "ros")]
mod mcap;
#[cfg(feature = "ros")]
mod mcap_file;
mod nav2;
mod npz;
mod options;
mod out_file;
mod output_format;
#[cfg(feature = "parquet")]
mod parquet;
mod pcd;
mod ply;
#[cfg(feature = "ros")]
mod point_cloud2;
mod registry;
mod row;
mod sort;
mod sorted_columns;
mod spool;
mod srgb;
mod stream_out;
#[cfg(test)]
mod testing;
mod tiff_file;
mod xyz;
mod zip_store;

pub use arrays::{NpyArray, write_arrays};
pub use file_unit::FileUnit;
pub use options::WriteOptions;
pub use output_format::{OpenFiles, OpenStream, Origin, OutputFormat, OutputOption, Writer};
pub use pcd::PCD_REACH_VOXELS;
pub use registry::OutputFormats;
pub use row::{RowLayers, VoxelRow, VoxelSink, VoxelsHead};
use voxtile::{Error, Result};
