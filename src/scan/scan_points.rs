use super::{Pose, Scan, ScanRef};
use crate::error::Result;
use crate::space::Point;
use std::ops::Range;

/// Takes a chunk of a scan's points, in metres, with their intensities if they have any. Returns whether to continue.
pub type TakePoints<'a> = dyn FnMut(&[Point], Option<&[f32]>) -> bool + 'a;

/// The points of a scan, in memory or in a file larger than memory, and where they were seen from.
pub trait ScanPoints: Sync {
    /// Position of the sensor in metres, world frame: every ray starts here.
    fn origin(&self) -> Point;

    /// When the scan was taken, in nanoseconds since the epoch of its source, if that is known.
    fn stamp_ns(&self) -> Option<i64> {
        None
    }

    /// Number of points.
    fn len(&self) -> usize;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether each point has an intensity.
    fn has_intensities(&self) -> bool;

    /// Passes the points of a range to `take` in order, chunk by chunk: in metres, world frame, with their intensities
    /// if they have any. `take` returns whether to continue. May be called several times and from several threads.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, intensities that do not match the points.
    fn for_each_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()>;

    /// The pose of the sensor, if the points are known in the sensor's frame.
    fn world_from_sensor(&self) -> Option<Pose> {
        None
    }

    /// As [`ScanPoints::for_each_chunk`], but in the sensor's frame where [`ScanPoints::world_from_sensor`] is known.
    /// The pose takes these points to the others, to the bit.
    ///
    /// # Errors
    ///
    /// As for [`ScanPoints::for_each_chunk`].
    fn for_each_own_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()> {
        self.for_each_chunk(range, take)
    }

    /// All points at once, if they lie in memory as [`ScanPoints::for_each_chunk`] passes them.
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
