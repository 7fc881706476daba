use super::transforms::{SearchFrames, Transforms, WhyNot};
use crate::poses::RigidPose;
use std::sync::Arc;
use voxtile::{Error, Result};

/// Lookup of the poses of one sensor in the world, at any time. Clones share the transforms.
#[derive(Clone, Debug)]
pub(super) struct PoseLookup {
    transforms: Arc<Transforms>,
    fixed_frame: String,
    sensor_frame: String,
    /// Frames to search between the sensor and the world.
    among: Arc<SearchFrames>,
}

impl PoseLookup {
    /// Creates a lookup.
    ///
    /// # Errors
    ///
    /// There are too many frames between the sensor and the world.
    pub(super) fn new(
        transforms: Arc<Transforms>,
        fixed_frame: String,
        sensor_frame: String,
    ) -> std::result::Result<Self, WhyNot> {
        let among = Arc::new(transforms.search_frames(&fixed_frame, &sensor_frame)?);
        Ok(Self { transforms, fixed_frame, sensor_frame, among })
    }

    /// Returns the pose of the sensor, if it is known.
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
