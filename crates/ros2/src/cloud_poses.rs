use voxtile_formats::RigidPose;

/// Poses at the stamp of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudPoses {
    pub map_from_sensor: RigidPose,
    /// Only with a ground filter.
    pub base_from_sensor: Option<RigidPose>,
}
