use crate::space::Point;
use nalgebra::Isometry3;

/// A scan: where the sensor was and what it hit, in the world frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scan {
    /// Position of the sensor in metres, world frame: every ray starts here.
    pub origin: Point,
    /// End points in metres, world frame. A point equal to the origin means "no return" and is skipped.
    pub points: Vec<Point>,
    /// Intensity of each point, if the sensor measures one.
    pub intensities: Option<Vec<f32>>,
}

impl Scan {
    /// A scan from points in the sensor frame and the pose that maps them to the world: `world = R * p + t`.
    ///
    /// The exact sensor-frame point (0, 0, 0), which drivers use for "no return", becomes the origin itself and
    /// is skipped on insertion.
    pub fn from_sensor_frame(
        points_in_sensor: &[Point],
        intensities: Option<Vec<f32>>,
        world_from_sensor: &Isometry3<f64>,
    ) -> Self {
        let rotation = world_from_sensor.rotation.to_rotation_matrix();
        let r = rotation.matrix();
        let t = world_from_sensor.translation.vector;
        // Spelled out, so that the order of operations, and with it the last bit, does not depend on a library.
        let to_world = |p: &Point| {
            std::array::from_fn(|i| r[(i, 0)] * p[0] + r[(i, 1)] * p[1] + r[(i, 2)] * p[2] + t[i])
        };
        Self { origin: [t.x, t.y, t.z], points: points_in_sensor.iter().map(to_world).collect(), intensities }
    }

    /// The same scan moved by a vector in metres.
    pub fn translated(mut self, by_m: Point) -> Self {
        let shift = |p: &mut Point| (0..3).for_each(|k| p[k] += by_m[k]);
        shift(&mut self.origin);
        self.points.iter_mut().for_each(shift);
        self
    }
}
