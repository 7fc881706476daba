use serde::Serialize;

/// `geometry_msgs/Pose`: metres, and a quaternion in the order x, y, z, w.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Pose {
    pub position: [f64; 3],
    pub orientation: [f64; 4],
}

impl Pose {
    /// Returns a pose without rotation.
    pub fn at(position: [f64; 3]) -> Self {
        Self { position, orientation: [0.0, 0.0, 0.0, 1.0] }
    }
}
