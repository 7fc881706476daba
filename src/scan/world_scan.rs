use super::Pose;
use crate::space::Point;

/// Scan with owned points in the world frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scan {
    /// Position of the sensor in metres, world frame: the origin of all rays.
    pub origin: Point,
    /// End points in metres, world frame. A point equal to the origin means "no return" and is skipped.
    pub points: Vec<Point>,
    /// Intensity of each point, if the sensor measures one.
    pub intensities: Option<Vec<f32>>,
}

impl Scan {
    /// Creates a scan from points in the sensor frame and the pose that transforms them to the world frame: `world = R
    /// * p + t`.
    ///
    /// The exact sensor-frame point (0, 0, 0), which drivers use for "no return", becomes the origin and is skipped on
    /// insertion.
    pub fn from_sensor_frame(
        points_in_sensor: &[Point],
        intensities: Option<Vec<f32>>,
        world_from_sensor: impl Into<Pose>,
    ) -> Self {
        let world_from_sensor = world_from_sensor.into();
        let points = points_in_sensor.iter().copied().map(world_from_sensor.to_world()).collect();
        Self { origin: world_from_sensor.position_m(), points, intensities }
    }

    /// Returns the scan translated by a vector in metres.
    pub fn translated(mut self, by_m: Point) -> Self {
        let shift = |p: &mut Point| (0..3).for_each(|k| p[k] += by_m[k]);
        shift(&mut self.origin);
        self.points.iter_mut().for_each(shift);
        self
    }
}
