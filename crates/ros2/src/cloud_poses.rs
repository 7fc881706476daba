use std::sync::Arc;
use voxtile::scan::Sweep;
use voxtile_formats::RigidPose;

/// Poses at the stamp of a cloud, and its motion.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudPoses {
    pub map_from_sensor: RigidPose,
    /// Only with a ground filter.
    pub base_from_sensor: Option<RigidPose>,
    /// Only for clouds that are deskewed.
    pub motion: Option<Motion>,
}

/// Motion of a sensor during a cloud.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    pub sweep: Arc<Sweep>,
    /// Whether poses at the times of some points did not arrive.
    pub is_partial: bool,
}
