use crate::space::{Grid, Point, VoxelIndex};
use serde::Serialize;

/// Voxel found by a query.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Hit {
    /// Index of the voxel.
    pub voxel: VoxelIndex,
    /// Center of the voxel in metres.
    pub center_m: Point,
    /// Distance in metres. For a ray or segment: from its origin to the point where it enters the voxel, 0 if it starts
    /// inside. For a nearest voxel: from the query point to the voxel's center. For a collision: from the body's
    /// center, or the start of a swept body, to the voxel's center.
    pub distance_m: f64,
    /// Probability of being occupied; `None` if the voxel is unknown.
    pub probability: Option<f64>,
}

impl Hit {
    /// Creates a hit with the distance from a point to the voxel's center.
    pub(crate) fn from(grid: &Grid, point: Point, voxel: VoxelIndex, probability: Option<f64>) -> Self {
        let center_m = grid.center_m(voxel);
        let distance_m = (0..3).map(|k| (center_m[k] - point[k]).powi(2)).sum::<f64>().sqrt();
        Self { voxel, center_m, distance_m, probability }
    }

    /// Returns whether this voxel is nearer than another. At equal distances, the lower index counts as nearer.
    pub(crate) fn is_nearer_than(&self, other: Option<&Self>) -> bool {
        other.is_none_or(|other| (self.distance_m, self.voxel) < (other.distance_m, other.voxel))
    }
}
