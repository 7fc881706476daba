use serde::Serialize;
use std::time::Duration;
use voxtile::scan::SkippedPoints;

/// Counts and times of one update of a local map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct LocalReport {
    /// Number of points received.
    pub points: u64,
    /// Skipped points by cause.
    pub skipped: SkippedPoints,
    /// Points skipped because they are beyond the input range.
    pub beyond_input_range: u64,
    /// Voxels that received evidence.
    pub updated: u64,
    /// New voxels among the updated ones.
    pub new: u64,
    /// Voxels removed because they are known to be free.
    pub freed: u64,
    /// Voxels removed because of the limit on voxels.
    pub forgotten: u64,
    /// Voxels that started or stopped inflating others.
    pub inflation_changes: u64,
    /// Whether the current parameters are applied to all voxels.
    pub is_settled: bool,
    /// Duration of each stage.
    pub times: StageTimes,
}

/// Durations of the stages of an update.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct StageTimes {
    /// Applying changed parameters.
    pub parameters: Duration,
    /// Input: points to voxels, hits (Algorithm 1).
    pub input: Duration,
    /// Rays: misses.
    pub rays: Duration,
    /// Occupancy check (`t_occ`).
    pub occupancy: Duration,
    /// History and removal (`t_m`, Algorithm 3).
    pub removal: Duration,
    /// Inflation (`t_inf`, Algorithm 2).
    pub inflation: Duration,
    /// Publishing the result to readers.
    pub publishing: Duration,
}

impl StageTimes {
    /// Returns the sum of all stages (`t_tot`).
    pub fn total(&self) -> Duration {
        self.parameters
            + self.input
            + self.rays
            + self.occupancy
            + self.removal
            + self.inflation
            + self.publishing
    }
}
