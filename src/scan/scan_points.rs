use super::{AttributeSet, AttributeSlices, MovingMarks, Pose, Scan, ScanRef, Sweep};
use crate::error::Result;
use crate::space::Point;
use std::ops::Range;

/// Callback that receives a chunk of a scan's points, in metres, with their intensities if they have any. Returns
/// whether to continue.
pub type TakePoints<'a> = dyn FnMut(&[Point], Option<&[f32]>) -> bool + 'a;

/// Callback that receives a chunk of a scan's points, in metres, with their intensities if they have any, and their
/// attributes. Returns whether to continue.
pub type TakeAttributed<'a> = dyn FnMut(&[Point], Option<&[f32]>, AttributeSlices<'_>) -> bool + 'a;

/// Frame in which points are passed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointFrame {
    /// The world frame.
    World,
    /// The sensor frame if the scan has points in it, else the world frame.
    Own,
    /// As measured: like [`PointFrame::Own`], but each point in the sensor frame at its own time, if the scan has a
    /// [`Sweep`]. Times are among the attributes.
    Raw,
}

/// Points of a scan, in memory or in a file that may exceed memory, and the position of the sensor.
pub trait ScanPoints: Sync {
    /// Position of the sensor in metres, world frame: the origin of all rays.
    fn origin(&self) -> Point;

    /// Acquisition time in nanoseconds since the epoch of its source, if known.
    fn stamp_ns(&self) -> Option<i64> {
        None
    }

    /// Number of points.
    fn len(&self) -> usize;

    /// Returns whether there are no points.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns whether each point has an intensity.
    fn has_intensities(&self) -> bool;

    /// Passes the points of a range to `take` in order, in chunks: in metres, world frame, with their intensities if
    /// they have any. Stops when `take` returns `false`. May be called several times and from several threads.
    ///
    /// # Errors
    ///
    /// Fails if a file cannot be read or the intensities do not match the points.
    fn for_each_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()>;

    /// The pose of the sensor, if the points are also available in the sensor frame.
    fn world_from_sensor(&self) -> Option<Pose> {
        None
    }

    /// Like [`ScanPoints::for_each_chunk`], but in the sensor frame if [`ScanPoints::world_from_sensor`] is known.
    /// Transforming these points by the pose gives bit-identical world points.
    ///
    /// # Errors
    ///
    /// Same errors as [`ScanPoints::for_each_chunk`].
    fn for_each_own_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()> {
        self.for_each_chunk(range, take)
    }

    /// Motion of the sensor during the scan, if its points have times. All but [`PointFrame::Raw`] points are already
    /// moved to the frame at the stamp.
    fn sweep(&self) -> Option<&Sweep> {
        None
    }

    /// Pose of the sensor in the body frame that the trajectory describes, if it is known and another frame: position in
    /// metres, then quaternion x, y, z, w.
    fn body_from_sensor(&self) -> Option<[f64; 7]> {
        None
    }

    /// Marks of the points that hit something that was moving; `None` if there are none. Such a point is no hit, but its
    /// ray passes free voxels.
    fn moving(&self) -> Option<&MovingMarks> {
        None
    }

    /// Which attributes the points have, besides intensities.
    fn attributes(&self) -> AttributeSet {
        AttributeSet::NONE
    }

    /// Like [`ScanPoints::for_each_chunk`], with the points' attributes, in the world frame or as
    /// [`ScanPoints::for_each_own_chunk`] passes them.
    ///
    /// # Errors
    ///
    /// Same errors as [`ScanPoints::for_each_chunk`].
    fn for_each_attributed_chunk(
        &self,
        range: Range<usize>,
        frame: PointFrame,
        take: &mut TakeAttributed<'_>,
    ) -> Result<()> {
        self.for_each_chunk_in(frame, range, &mut |points, intensities| {
            take(points, intensities, AttributeSlices::default())
        })
    }

    /// Passes the points in either frame: [`ScanPoints::for_each_chunk`] or [`ScanPoints::for_each_own_chunk`].
    ///
    /// # Errors
    ///
    /// Same errors as [`ScanPoints::for_each_chunk`].
    fn for_each_chunk_in(
        &self,
        frame: PointFrame,
        range: Range<usize>,
        take: &mut TakePoints<'_>,
    ) -> Result<()> {
        match frame {
            PointFrame::World => self.for_each_chunk(range, take),
            PointFrame::Own | PointFrame::Raw => self.for_each_own_chunk(range, take),
        }
    }

    /// All points, if they are in memory in the form that [`ScanPoints::for_each_chunk`] passes.
    fn in_memory(&self) -> Option<&[Point]> {
        None
    }
}

impl ScanPoints for Scan {
    fn origin(&self) -> Point {
        self.origin
    }

    fn len(&self) -> usize {
        self.points.len()
    }

    fn has_intensities(&self) -> bool {
        self.intensities.is_some()
    }

    fn for_each_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()> {
        let scan = ScanRef::in_world(self.origin, &self.points);
        match &self.intensities {
            Some(intensities) => scan.with_intensities(intensities)?.for_each_chunk(range, take),
            None => scan.for_each_chunk(range, take),
        }
    }

    fn in_memory(&self) -> Option<&[Point]> {
        Some(&self.points)
    }
}
