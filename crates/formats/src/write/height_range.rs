use super::options::WriteOptions;
use super::row::VoxelRow;
use super::{Error, Result};

/// Range of heights of the voxels in a 2D grid.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeightRange {
    min_m: f64,
    max_m: f64,
}

impl HeightRange {
    /// Creates the range from the options; unlimited by default.
    ///
    /// # Errors
    ///
    /// The range is empty.
    pub(super) fn of(options: &WriteOptions) -> Result<Self> {
        let min_m = options.z_min_m.unwrap_or(f64::NEG_INFINITY);
        let max_m = options.z_max_m.unwrap_or(f64::INFINITY);
        if min_m < max_m {
            return Ok(Self { min_m, max_m });
        }
        let reason =
            format!("the range of heights from {min_m} to {max_m} m is empty: z_min must be below z_max");
        Err(Error::argument("z_min, z_max", reason))
    }

    /// Returns whether a voxel overlaps the range.
    pub(super) fn meets(&self, voxel: &VoxelRow, resolution_m: f64) -> bool {
        let (center_m, half_m) = (voxel.center_m[2], 0.5 * resolution_m);
        center_m + half_m > self.min_m && center_m - half_m < self.max_m
    }
}
