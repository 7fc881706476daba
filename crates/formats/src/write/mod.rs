//! Voxels as files of other programs, one format a file.
//!
//! ```text
//! VoxelsHead, WriteOptions -> open_sink -> VoxelSink <- VoxelRow after VoxelRow, then finish
//! ```
//!
//! A sink writes to the path that it is given; who calls renames it when it is whole. What cannot be written in the
//! order of the voxels is sorted in files without names beside the output: memory does not grow with the voxels, but
//! for the flat grids of [`VoxelFileFormat::Nav2Map`] and [`VoxelFileFormat::Heightmap`].

mod autoware;
mod column_grid;
#[cfg(feature = "las")]
mod copc;
#[cfg(feature = "las")]
mod copc_levels;
mod counted;
#[cfg(feature = "e57")]
mod e57;
mod flat_map;
mod format;
mod glb;
mod glb_json;
mod greedy;
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
mod open;
mod options;
mod out_file;
#[cfg(feature = "parquet")]
mod parquet;
#[cfg(feature = "ros")]
mod point_cloud2;
mod row;
mod sort;
mod spool;
#[cfg(test)]
mod testing;
mod xyz;
mod zip_store;

use crate::clouds::{Error, Result};
pub use format::VoxelFileFormat;
pub use open::open_sink;
pub use options::WriteOptions;
pub use row::{VoxelRow, VoxelSink, VoxelsHead};
