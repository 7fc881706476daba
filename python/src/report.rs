//! `voxtile.InsertReport`: counts of an insert.

use pyo3::prelude::*;
use voxtile::ScanReport;

/// Counts of the points of a scan, or of several, and of the updates that they made.
#[pyclass(frozen, get_all, eq, module = "voxtile")]
#[derive(PartialEq)]
pub struct InsertReport {
    /// Points received.
    points: u64,
    /// Points skipped for any reason.
    skipped: u64,
    /// Points with a coordinate that is NaN or infinite.
    not_finite: u64,
    /// Points beyond the range of voxel indices.
    out_of_range: u64,
    /// Points at the sensor's own origin: no return.
    no_return: u64,
    /// Points closer than the minimum range.
    too_near: u64,
    /// Points whose ray would cross more than a million voxels.
    ray_too_long: u64,
    /// Points without the intensity that the sensor model needs.
    no_intensity: u64,
    /// Points beyond the maximum range, whose rays were cut there.
    cut_at_max_range: u64,
    /// Voxel updates by hits.
    hits: u64,
    /// Voxel updates by misses.
    misses: u64,
    /// Tiles with updates, counted once per scan.
    tiles_touched: u64,
}

impl From<ScanReport> for InsertReport {
    fn from(report: ScanReport) -> Self {
        let ScanReport { points, skipped, cut_at_max_range, hits, misses, tiles_touched, .. } = report;
        Self {
            points,
            skipped: skipped.total(),
            not_finite: skipped.not_finite,
            out_of_range: skipped.out_of_range,
            no_return: skipped.no_return,
            too_near: skipped.too_near,
            ray_too_long: skipped.ray_too_long,
            no_intensity: skipped.no_intensity,
            cut_at_max_range,
            hits,
            misses,
            tiles_touched,
        }
    }
}

impl InsertReport {
    /// Adds the counts of another report.
    pub fn add(&mut self, other: &Self) {
        self.points += other.points;
        self.skipped += other.skipped;
        self.not_finite += other.not_finite;
        self.out_of_range += other.out_of_range;
        self.no_return += other.no_return;
        self.too_near += other.too_near;
        self.ray_too_long += other.ray_too_long;
        self.no_intensity += other.no_intensity;
        self.cut_at_max_range += other.cut_at_max_range;
        self.hits += other.hits;
        self.misses += other.misses;
        self.tiles_touched += other.tiles_touched;
    }
}

#[pymethods]
impl InsertReport {
    fn __repr__(&self) -> String {
        let Self { points, skipped, hits, misses, .. } = self;
        format!("InsertReport(points={points}, skipped={skipped}, hits={hits}, misses={misses})")
    }
}
