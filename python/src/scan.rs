//! Scans of numpy arrays, as the library takes them.

use crate::arrays::{PointSlice, Points, singles};
use crate::errors::{exception, wrong};
use crate::layers::attributes_of;
use crate::pose::{point_of, pose_of};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use voxtile::{Point, PointAttributes, Pose, ScanRef};

/// Frame of a scan's points.
pub enum Frame {
    /// The sensor's frame, at a pose.
    Sensor(Pose),
    /// The world's frame, with the origin of the rays.
    World(Point),
}

impl Frame {
    /// Takes either a pose or an origin.
    pub fn of(
        py: Python<'_>,
        pose: Option<&Bound<'_, PyAny>>,
        origin: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        match (pose, origin) {
            (Some(pose), None) => Ok(Self::Sensor(pose_of(pose)?)),
            (None, Some(origin)) => Ok(Self::World(point_of("origin", origin)?)),
            _ => {
                let reason =
                    "pass either the pose of the sensor, or its origin if points are in the world's frame";
                Err(wrong(py, "pose", reason))
            }
        }
    }

    /// Returns the scan of these points.
    pub fn scan<'a>(&self, points: PointSlice<'a>) -> ScanRef<'a> {
        match (self, points) {
            (Self::Sensor(pose), PointSlice::F32(points)) => ScanRef::in_sensor(*pose, points),
            (Self::Sensor(pose), PointSlice::F64(points)) => ScanRef::in_sensor(*pose, points),
            (Self::World(origin), PointSlice::F32(points)) => ScanRef::in_world(*origin, points),
            (Self::World(origin), PointSlice::F64(points)) => ScanRef::in_world(*origin, points),
        }
    }
}

/// A scan as passed by the caller.
pub struct GivenScan<'py> {
    points: Points<'py>,
    frame: Frame,
    intensities: Option<PyReadonlyArray1<'py, f32>>,
    attributes: PointAttributes,
}

impl<'py> GivenScan<'py> {
    /// Takes arguments: points, one of pose and origin, and optional intensities.
    pub fn of(
        points: &Bound<'py, PyAny>,
        pose: Option<&Bound<'py, PyAny>>,
        origin: Option<&Bound<'py, PyAny>>,
        intensities: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Self> {
        let frame = Frame::of(points.py(), pose, origin)?;
        let intensities = intensities.map(|intensities| singles("intensities", intensities)).transpose()?;
        let attributes = PointAttributes::default();
        Ok(Self { points: Points::of("points", points)?, frame, intensities, attributes })
    }

    /// Adds colours and classes, for the layers of a map.
    pub fn with_attributes(
        mut self,
        colours: Option<&Bound<'py, PyAny>>,
        classes: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Self> {
        self.attributes = attributes_of(self.points.slice()?.len(), colours, classes)?;
        Ok(self)
    }

    /// Takes a pair of points and pose, or a triple with intensities.
    pub fn of_tuple(scan: &Bound<'py, PyAny>) -> PyResult<Self> {
        type Pair<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>);
        type Triple<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>);
        let (points, pose, intensities) = match scan.extract::<Pair<'py>>() {
            Ok((points, pose)) => (points, pose, None),
            Err(_) => {
                let (points, pose, intensities): Triple<'py> = scan.extract().map_err(|_| {
                    let reason = "must be pairs of points and pose, or triples with intensities";
                    wrong(scan.py(), "scans", reason)
                })?;
                (points, pose, Some(intensities).filter(|intensities| !intensities.is_none()))
            }
        };
        Self::of(&points, Some(&pose), None, intensities.as_ref())
    }

    /// Returns the scan, borrowed.
    pub fn scan(&self, py: Python<'_>) -> PyResult<ScanRef<'_>> {
        let scan = self.frame.scan(self.points.slice()?);
        let scan = scan.with_attributes(&self.attributes).map_err(|error| exception(py, &error))?;
        match &self.intensities {
            None => Ok(scan),
            Some(intensities) => {
                scan.with_intensities(intensities.as_slice()?).map_err(|error| exception(py, &error))
            }
        }
    }
}
