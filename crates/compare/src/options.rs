use crate::viewpoints::Viewpoints;
use voxtile::maths::least_logit;
use voxtile::scan::Stop;
use voxtile::{Aabb, Error, Grid, Result};

/// Largest tolerance in voxels.
pub const MAX_TOLERANCE_VOXELS: u32 = 16;

/// Options of [`compare`](crate::compare()).
#[derive(Clone, Debug)]
#[non_exhaustive]
#[must_use]
pub struct CompareOptions {
    /// Distance in metres along each axis, rounded to whole voxels, within which an occupied voxel of the other map is
    /// the same surface. Default: one voxel.
    pub tolerance_m: Option<f64>,
    /// Voxels of the smallest cluster that is listed. Default: 8.
    pub min_voxels: u64,
    /// Probability, above 0.5 and below 1. A voxel has changed if it is occupied in one map and free in the other, each
    /// with at least this probability; with less, the change is uncertain. Default: 0.7.
    pub certainty: f64,
    /// Box in metres: only voxels whose center is inside are compared. Default: all.
    pub region: Option<Aabb>,
    /// Positions of the sensors of the earlier and the later map, if they are known: with them, what one map has not
    /// observed is hidden or out of view. Default: unknown.
    pub viewpoints: [Option<Viewpoints>; 2],
    /// Bytes of memory for tiles, but at least what one block needs. Default: 256 MiB.
    pub memory_bytes: usize,
    /// Stops the comparison.
    pub stop: Stop,
}

impl Default for CompareOptions {
    fn default() -> Self {
        Self {
            tolerance_m: None,
            min_voxels: 8,
            certainty: 0.7,
            region: None,
            viewpoints: [None, None],
            memory_bytes: 256 << 20,
            stop: Stop::default(),
        }
    }
}

impl CompareOptions {
    /// Sets the tolerance in metres.
    pub fn with_tolerance(self, tolerance_m: impl Into<Option<f64>>) -> Self {
        Self { tolerance_m: tolerance_m.into(), ..self }
    }

    /// Sets the voxels of the smallest cluster that is listed.
    pub fn with_min_voxels(self, min_voxels: u64) -> Self {
        Self { min_voxels, ..self }
    }

    /// Sets the probability that both maps need for a change.
    pub fn with_certainty(self, certainty: f64) -> Self {
        Self { certainty, ..self }
    }

    /// Sets the box in metres.
    pub fn with_region(self, region: impl Into<Option<Aabb>>) -> Self {
        Self { region: region.into(), ..self }
    }

    /// Sets the positions of the sensors of both maps.
    pub fn with_viewpoints(self, viewpoints: [Option<Viewpoints>; 2]) -> Self {
        Self { viewpoints, ..self }
    }

    /// Sets the bytes of memory for tiles.
    pub fn with_memory(self, memory_bytes: usize) -> Self {
        Self { memory_bytes, ..self }
    }

    /// Sets what stops the comparison.
    pub fn with_stop(self, stop: Stop) -> Self {
        Self { stop, ..self }
    }

    /// The tolerance in voxels.
    pub(crate) fn tolerance_voxels(&self, grid: &Grid) -> Result<u32> {
        let Some(tolerance_m) = self.tolerance_m else { return Ok(1) };
        let voxels = (tolerance_m / grid.resolution_m()).round();
        if (0.0..=f64::from(MAX_TOLERANCE_VOXELS)).contains(&voxels) && tolerance_m >= 0.0 {
            return Ok(voxels as u32);
        }
        let most_m = grid.corner_m(MAX_TOLERANCE_VOXELS as i32);
        let reason =
            format!("must be from 0 to {most_m} m ({MAX_TOLERANCE_VOXELS} voxels), not {tolerance_m}");
        Err(Error::argument("tolerance", reason))
    }

    /// The least log-odds of a certainly occupied voxel; their negative is the largest of a certainly free one.
    pub(crate) fn certain_log_odds(&self) -> Result<f64> {
        if self.certainty > 0.5 && self.certainty < 1.0 {
            return Ok(least_logit(self.certainty));
        }
        let reason = format!("must be above 0.5 and below 1, not {}", self.certainty);
        Err(Error::argument("certainty", reason))
    }
}
