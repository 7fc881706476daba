use super::transforms::{Transforms, WhyNot};
use crate::error::Error;
use crate::pose::RigidPose;
use std::sync::Arc;

/// Looks up where a sensor was in the world, for as long as anybody asks.
pub(super) struct PoseLookup {
    transforms: Arc<Transforms>,
    fixed_frame: String,
    sensor_frame: String,
}

impl PoseLookup {
    pub(super) fn new(transforms: Arc<Transforms>, fixed_frame: String, sensor_frame: String) -> Self {
        Self { transforms, fixed_frame, sensor_frame }
    }

    /// Where the sensor was, if that is known.
    pub(super) fn pose(&self, stamp_ns: i64) -> crate::error::Result<Option<RigidPose>> {
        match self.find(stamp_ns) {
            Err(WhyNot::Unreadable(why)) => Err(Error::argument("poses of the recording", why)),
            found => Ok(found.ok()),
        }
    }

    pub(super) fn find(&self, stamp_ns: i64) -> Result<RigidPose, WhyNot> {
        self.transforms.lookup(&self.fixed_frame, &self.sensor_frame, stamp_ns)
    }
}
