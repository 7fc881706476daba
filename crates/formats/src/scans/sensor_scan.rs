use voxtile::scan::{PointAttributes, Pose, Scan};
use voxtile::space::Point;

/// Scan in the sensor frame, with the sensor's pose.
#[derive(Clone, Debug)]
pub struct SensorScan {
    /// Name in its source: a file name or a number.
    pub name: String,
    /// End points in the sensor frame, in metres.
    pub points_in_sensor: Vec<Point>,
    /// Intensity of each point, if the source has intensities.
    pub intensities: Option<Vec<f32>>,
    /// Colours and classes of the points, if they were requested and the source has them.
    pub attributes: PointAttributes,
    /// Pose of the sensor: `world = R * p + t`.
    pub world_from_sensor: Pose,
}

impl SensorScan {
    /// Transforms the scan to the world frame, without attributes.
    pub fn into_scan(self) -> Scan {
        Scan::from_sensor_frame(&self.points_in_sensor, self.intensities, self.world_from_sensor)
    }
}
