use crate::space::{Grid, Point, VoxelIndex};
use serde::Serialize;

/// The voxel that a query found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Hit {
    /// Its index.
    pub voxel: VoxelIndex,
    /// Its center in metres.
    pub center_m: Point,
    /// How far away, in metres. Of a ray or segment: from its origin to where it enters the voxel, 0 if it begins
    /// there. Of a nearest voxel: from the point to its center. Of a collision: from the body's center, or from where
    /// a swept one begins, to the voxel's center.
    pub distance_m: f64,
    /// Probability of being occupied; `None` if the voxel is unknown.
    pub probability: Option<f64>,
}

impl Hit {
    /// A voxel as seen from a point, by its center.
    pub(crate) fn from(grid: &Grid, point: Point, voxel: VoxelIndex, probability: Option<f64>) -> Self {
        let center_m = grid.center_m(voxel);
        let distance_m = (0..3).map(|k| (center_m[k] - point[k]).powi(2)).sum::<f64>().sqrt();
        Self { voxel, center_m, distance_m, probability }
    }

    /// Whether this voxel is nearer than another; of equals, the lower index is.
    pub(crate) fn is_nearer_than(&self, other: Option<&Self>) -> bool {
        other.is_none_or(|other| (self.distance_m, self.voxel) < (other.distance_m, other.voxel))
    }
}
