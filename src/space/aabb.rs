use super::{Point, VoxelIndex};
use serde::Serialize;
use std::fmt;

/// Axis-aligned box in metres, half-open: `min <= p < max` along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Aabb {
    /// Lower corner in metres, included.
    pub min: Point,
    /// Upper corner in metres, excluded.
    pub max: Point,
}

impl fmt::Display for Aabb {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the box from {:?} to {:?} m", self.min, self.max)
    }
}

impl Aabb {
    /// Creates the box between two corners in any order.
    pub fn from_corners(a: Point, b: Point) -> Self {
        Self { min: std::array::from_fn(|k| a[k].min(b[k])), max: std::array::from_fn(|k| a[k].max(b[k])) }
    }

    /// Returns whether the box contains the point.
    pub fn contains(&self, point: Point) -> bool {
        (0..3).all(|k| self.min[k] <= point[k] && point[k] < self.max[k])
    }

    /// Squared distance in square metres from a point to the nearest point of the box, 0 inside.
    pub fn distance_squared(&self, point: Point) -> f64 {
        (0..3)
            .map(|k| {
                let outside = (self.min[k] - point[k]).max(point[k] - self.max[k]).max(0.0);
                outside * outside
            })
            .sum()
    }
}

/// Box of whole voxels, half-open: `min <= index < end` along each axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VoxelBox {
    /// Lowest voxel.
    pub min: VoxelIndex,
    /// One past the highest voxel.
    pub end: VoxelIndex,
}

impl VoxelBox {
    /// Returns whether the box contains the voxel.
    #[inline]
    pub fn contains(&self, voxel: VoxelIndex) -> bool {
        (0..3).all(|k| self.min[k] <= voxel[k] && voxel[k] < self.end[k])
    }

    /// Returns whether the box contains no voxel.
    pub fn is_empty(&self) -> bool {
        (0..3).any(|k| self.min[k] >= self.end[k])
    }

    /// Returns the voxels that are in both boxes.
    pub fn intersection(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|k| self.min[k].max(other.min[k])),
            end: std::array::from_fn(|k| self.end[k].min(other.end[k])),
        }
    }
}
