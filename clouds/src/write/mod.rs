//! Voxels as files of other programs, one format a file.

mod row;

pub use row::{VoxelRow, VoxelSink, VoxelsHead};
