use voxtile::scan::{Pose, Scan};
use voxtile::space::Point;

/// A scan in the sensor's frame, and the sensor's pose.
#[derive(Clone, Debug)]
pub struct SensorScan {
    /// Name of the scan in its source: a file name or a number.
    pub name: String,
    /// End points in metres, sensor frame.
    pub points_in_sensor: Vec<Point>,
    /// Intensity of each point, if the source has it.
    pub intensities: Option<Vec<f32>>,
    /// Pose of the sensor: `world = R * p + t`.
    pub world_from_sensor: Pose,
}

impl SensorScan {
    /// The scan in the world frame.
    pub fn into_scan(self) -> Scan {
        Scan::from_sensor_frame(&self.points_in_sensor, self.intensities, self.world_from_sensor)
    }
}
