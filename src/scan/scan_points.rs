use super::Scan;
use crate::error::Result;
use crate::space::Point;
use std::ops::Range;

/// Takes some points of a scan, in metres, with their intensities if they have any; says whether to go on.
pub type TakePoints<'a> = dyn FnMut(&[Point], Option<&[f32]>) -> bool + 'a;

/// The points of a scan, wherever they lie: in memory, or in a file that is larger than that.
pub trait ScanPoints: Sync {
    /// Number of points.
    fn len(&self) -> usize;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether each point has an intensity.
    fn has_intensities(&self) -> bool;

    /// Hands over the points of a range in order, some at a time: in metres, world frame, with their intensities if they
    /// have any. `take` says whether to go on. Points may be asked for several times, by several threads.
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
