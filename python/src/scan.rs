//! A scan of arrays, as the library takes it.

use crate::arrays::PointSlice;
use crate::errors::wrong;
use crate::pose::{point_of, pose_of};
use pyo3::prelude::*;
use voxtile::{Point, Pose, ScanRef};

/// The frame of a scan's points.
pub enum Frame {
    /// The sensor's, at a pose.
    Sensor(Pose),
    /// The world's; rays begin here.
    World(Point),
}

impl Frame {
    /// What a caller names: either a pose or an origin.
    pub fn of(
        py: Python<'_>,
        pose: Option<&Bound<'_, PyAny>>,
        origin: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        match (pose, origin) {
            (Some(pose), None) => Ok(Self::Sensor(pose_of(pose)?)),
            (None, Some(origin)) => Ok(Self::World(point_of("origin", origin)?)),
            _ => {
                let reason = "name either the pose of the sensor, or its origin for points of the world";
                Err(wrong(py, "pose", reason))
            }
        }
    }

    /// The scan of these points.
    pub fn scan<'a>(&self, points: PointSlice<'a>) -> ScanRef<'a> {
        match (self, points) {
            (Self::Sensor(pose), PointSlice::F32(points)) => ScanRef::in_sensor(*pose, points),
            (Self::Sensor(pose), PointSlice::F64(points)) => ScanRef::in_sensor(*pose, points),
            (Self::World(origin), PointSlice::F32(points)) => ScanRef::in_world(*origin, points),
            (Self::World(origin), PointSlice::F64(points)) => ScanRef::in_world(*origin, points),
        }
    }
}
