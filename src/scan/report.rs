use serde::Serialize;
use std::ops::AddAssign;

/// Counts of the points and updates of a scan or batch. Reports can be added with `+=`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct ScanReport {
    /// Points received.
    pub points: u64,
    /// Skipped points, by cause.
    pub skipped: SkippedPoints,
    /// Points beyond the max range, whose rays were clipped there.
    pub cut_at_max_range: u64,
    /// Voxel updates by hits.
    pub hits: u64,
    /// Voxel updates by misses.
    pub misses: u64,
    /// Tiles with updates, each counted once per scan.
    pub tiles_touched: u64,
}

/// Skipped points, by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct SkippedPoints {
    /// Points with a coordinate that is NaN or infinite.
    pub not_finite: u64,
    /// Points whose coordinates exceed the voxel index range.
    pub out_of_range: u64,
    /// Points equal to the sensor's origin, which drivers use for "no return".
    pub no_return: u64,
    /// Points closer than the min range.
    pub too_near: u64,
    /// Points whose rays would cross more than a million voxels.
    pub ray_too_long: u64,
    /// Points whose intensity is NaN although the sensor model needs it.
    pub no_intensity: u64,
}

impl SkippedPoints {
    /// Number of all skipped points.
    pub fn total(&self) -> u64 {
        self.by_cause().iter().map(|(_, count)| count).sum()
    }

    /// Each cause as text, with its count.
    pub fn by_cause(&self) -> [(&'static str, u64); 6] {
        [
            ("not finite", self.not_finite),
            ("out of range", self.out_of_range),
            ("no return", self.no_return),
            ("nearer than the min range", self.too_near),
            ("ray too long", self.ray_too_long),
            ("no intensity", self.no_intensity),
        ]
    }
}

impl AddAssign for ScanReport {
    fn add_assign(&mut self, other: Self) {
        self.points += other.points;
        self.skipped += other.skipped;
        self.cut_at_max_range += other.cut_at_max_range;
        self.hits += other.hits;
        self.misses += other.misses;
        self.tiles_touched += other.tiles_touched;
    }
}

impl AddAssign for SkippedPoints {
    fn add_assign(&mut self, other: Self) {
        self.not_finite += other.not_finite;
        self.out_of_range += other.out_of_range;
        self.no_return += other.no_return;
        self.too_near += other.too_near;
        self.ray_too_long += other.ray_too_long;
        self.no_intensity += other.no_intensity;
    }
}
