use super::Scan;
use crate::error::Result;
use crate::space::Point;
use std::ops::Range;

/// Takes a chunk of a scan's points, in metres, with their intensities if they have any. Returns whether to continue.
pub type TakePoints<'a> = dyn FnMut(&[Point], Option<&[f32]>) -> bool + 'a;

/// The points of a scan, in memory or in a file larger than memory.
pub trait ScanPoints: Sync {
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
    /// A file that cannot be read.
    fn for_each_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()>;
}

impl ScanPoints for Scan {
    fn len(&self) -> usize {
        self.points.len()
    }

    fn has_intensities(&self) -> bool {
        self.intensities.is_some()
    }

    fn for_each_chunk(&self, range: Range<usize>, take: &mut TakePoints<'_>) -> Result<()> {
        let intensities = self.intensities.as_ref().map(|intensities| &intensities[range.clone()]);
        take(&self.points[range], intensities);
        Ok(())
    }
}
