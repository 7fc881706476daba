use super::Label;
use voxtile::scan::{Pose, Scan};

/// Scan with the label of each point and the pose of the sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelledScan {
    /// Points in metres, world frame.
    pub scan: Scan,
    /// Label of each point, in the order of the points.
    pub labels: Vec<Label>,
    /// Pose of the sensor; its x axis points ahead, y to the left, z up.
    pub world_from_sensor: Pose,
}
