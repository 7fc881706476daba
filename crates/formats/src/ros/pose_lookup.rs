use super::transforms::{SearchFrames, Transforms, WhyNot};
use crate::poses::RigidPose;
use std::sync::Arc;
use voxtile::{Error, Result};

/// Looks up where a sensor was in the world, for as long as anybody asks.
#[derive(Clone, Debug)]
pub(super) struct PoseLookup {
    transforms: Arc<Transforms>,
    fixed_frame: String,
    sensor_frame: String,
    /// The frames that lead from the sensor to the world.
    among: Arc<SearchFrames>,
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
        let among = Arc::new(transforms.search_frames(&fixed_frame, &sensor_frame)?);
        Ok(Self { transforms, fixed_frame, sensor_frame, among })
    }

    /// Where the sensor was, if that is known.
    pub(super) fn pose(&self, stamp_ns: i64) -> Result<Option<RigidPose>> {
        match self.find(stamp_ns) {
            Err(WhyNot::Unreadable(why)) => Err(Error::argument("poses of the recording", why)),
            found => Ok(found.ok()),
        }
    }

    pub(super) fn find(&self, stamp_ns: i64) -> std::result::Result<RigidPose, WhyNot> {
        let Self { transforms, fixed_frame, sensor_frame, among } = self;
        transforms.lookup_among(fixed_frame, sensor_frame, stamp_ns, Some(among))
    }
}
