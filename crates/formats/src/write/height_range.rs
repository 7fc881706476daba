use super::options::WriteOptions;
use super::row::VoxelRow;
use super::{Error, Result};

/// Range of heights of the voxels in a 2D grid.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeightRange {
    least_m: f64,
    most_m: f64,
}

impl HeightRange {
    /// Creates the range from the options; unlimited by default.
    ///
    /// # Errors
    ///
    /// The range is empty.
    pub(super) fn of(options: &WriteOptions) -> Result<Self> {
        let least_m = options.z_min_m.unwrap_or(f64::NEG_INFINITY);
        let most_m = options.z_max_m.unwrap_or(f64::INFINITY);
        if least_m < most_m {
            return Ok(Self { least_m, most_m });
        }
        let reason =
            format!("the range of heights from {least_m} to {most_m} m is empty: z_min must be below z_max");
        Err(Error::argument("z_min, z_max", reason))
    }

    /// Returns whether a voxel overlaps the range.
    pub(super) fn meets(&self, voxel: &VoxelRow, resolution_m: f64) -> bool {
        let (center_m, half_m) = (voxel.center_m[2], 0.5 * resolution_m);
        center_m + half_m > self.least_m && center_m - half_m < self.most_m
    }
}
