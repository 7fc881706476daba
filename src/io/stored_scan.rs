use super::point_store::PointStore;
use crate::error::Result;
use crate::scan::{Scan, ScanPoints, TakePoints};
use crate::space::Point;
use nalgebra::Isometry3;
use std::ops::Range;

/// A scan of any size in the sensor's frame, and the sensor's pose.
///
/// As [`ScanPoints`] its points are in the world frame.
#[derive(Debug)]
pub struct StoredScan {
    /// Name of the scan in its source: a file name or a number.
    pub name: String,
    /// End points in metres, sensor frame.
    pub points_in_sensor: PointStore,
    /// Pose of the sensor: `world = R * p + t`.
    pub world_from_sensor: Isometry3<f64>,
}

impl StoredScan {
    /// Position of the sensor in metres, world frame.
    pub fn origin(&self) -> Point {
        self.world_from_sensor.translation.vector.into()
    }
}

impl ScanPoints for StoredScan {
    fn len(&self) -> usize {
        self.points_in_sensor.len()
    }

    fn has_intensities(&self) -> bool {
        self.points_in_sensor.has_intensities()
    }

    fn for_each_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()> {
        self.points_in_sensor.for_each_chunk(range, &mut |points, intensities| {
            let scan = Scan::from_sensor_frame(points, None, &self.world_from_sensor);
            take(&scan.points, intensities)
        })
    }
}
