use super::transforms::{Transforms, WhyNot};
use crate::error::{Error, Result};
use crate::pose::RigidPose;
use std::collections::HashSet;
use std::sync::Arc;

/// Looks up where a sensor was in the world, for as long as anybody asks.
#[derive(Clone, Debug)]
pub(super) struct PoseLookup {
    transforms: Arc<Transforms>,
    fixed_frame: String,
    sensor_frame: String,
    /// The frames that lead from the sensor to the world.
    between: Arc<HashSet<String>>,
}

impl PoseLookup {
    /// # Errors
    ///
    /// There are too many frames between.
    pub(super) fn new(
        transforms: Arc<Transforms>,
        fixed_frame: String,
        sensor_frame: String,
    ) -> std::result::Result<Self, WhyNot> {
        let between = Arc::new(transforms.frames_between(&fixed_frame, &sensor_frame)?);
        Ok(Self { transforms, fixed_frame, sensor_frame, between })
    }

    /// Where the sensor was, if that is known.
    pub(super) fn pose(&self, stamp_ns: i64) -> Result<Option<RigidPose>> {
        match self.find(stamp_ns) {
            Err(WhyNot::Unreadable(why)) => Err(Error::argument("poses of the recording", why)),
            found => Ok(found.ok()),
        }
    }

    pub(super) fn find(&self, stamp_ns: i64) -> std::result::Result<RigidPose, WhyNot> {
        let Self { transforms, fixed_frame, sensor_frame, between } = self;
        transforms.lookup_among(fixed_frame, sensor_frame, stamp_ns, Some(between))
    }
}
