use super::NO_TIME;
use crate::error::{Error, Result};
use std::ops::Range;

/// Attributes of points besides coordinates and intensities, for a map's layers.
///
/// A list is either empty, because no point has the attribute, or has an entry per point.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PointAttributes {
    /// Red, green and blue; `None` for a point without a colour.
    pub colours: Vec<Option<[u8; 3]>>,
    /// Class; `None` for a point without one.
    pub classes: Vec<Option<u8>>,
    /// Time in nanoseconds after the stamp of the scan; [`NO_TIME`] for a point without one.
    pub times_ns: Vec<i64>,
}

/// Attributes of some points. A list is either empty, because no point has the attribute, or has an entry per point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AttributeSlices<'a> {
    /// Red, green and blue; `None` for a point without a colour.
    pub colours: &'a [Option<[u8; 3]>],
    /// Class; `None` for a point without one.
    pub classes: &'a [Option<u8>],
    /// Time in nanoseconds after the stamp of the scan; [`NO_TIME`] for a point without one.
    pub times_ns: &'a [i64],
}

impl<'a> AttributeSlices<'a> {
    /// Attributes of a range of the points.
    pub fn part(self, range: Range<usize>) -> Self {
        AttributeSlices {
            colours: self.colours.get(range.clone()).unwrap_or_default(),
            classes: self.classes.get(range.clone()).unwrap_or_default(),
            times_ns: self.times_ns.get(range).unwrap_or_default(),
        }
    }

    /// Colour of a point.
    #[inline]
    pub fn colour(&self, number: usize) -> Option<[u8; 3]> {
        self.colours.get(number).copied().flatten()
    }

    /// Class of a point.
    #[inline]
    pub fn class(&self, number: usize) -> Option<u8> {
        self.classes.get(number).copied().flatten()
    }

    /// Time of a point in nanoseconds after the stamp of the scan.
    #[inline]
    pub fn time_ns(&self, number: usize) -> i64 {
        self.times_ns.get(number).copied().unwrap_or(NO_TIME)
    }
}

/// Attributes that the points of a scan have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AttributeSet {
    /// Whether points have colours.
    pub colours: bool,
    /// Whether points have classes.
    pub classes: bool,
    /// Whether points have times, to compensate the motion of the sensor.
    pub times: bool,
}

impl PointAttributes {
    /// Which attributes there are.
    pub fn set(&self) -> AttributeSet {
        AttributeSet {
            colours: !self.colours.is_empty(),
            classes: !self.classes.is_empty(),
            times: !self.times_ns.is_empty(),
        }
    }

    /// Removes all entries.
    pub fn clear(&mut self) {
        self.colours.clear();
        self.classes.clear();
        self.times_ns.clear();
    }

    /// Attributes of a range of points.
    pub fn part(&self, range: Range<usize>) -> AttributeSlices<'_> {
        self.all().part(range)
    }

    /// Attributes of all points.
    pub fn all(&self) -> AttributeSlices<'_> {
        AttributeSlices { colours: &self.colours, classes: &self.classes, times_ns: &self.times_ns }
    }

    /// Appends attributes of further points.
    pub fn extend(&mut self, more: AttributeSlices<'_>) {
        self.colours.extend_from_slice(more.colours);
        self.classes.extend_from_slice(more.classes);
        self.times_ns.extend_from_slice(more.times_ns);
    }

    /// Checks that each list is empty or has an entry per point.
    ///
    /// # Errors
    ///
    /// A list of another length.
    pub fn check_count(&self, points: usize) -> Result<()> {
        let Self { colours, classes, times_ns } = self;
        for (name, count) in
            [("colours", colours.len()), ("classes", classes.len()), ("times", times_ns.len())]
        {
            if count != 0 && count != points {
                let reason = format!("{count} for {points} points; one per point is needed");
                return Err(Error::argument(name, reason));
            }
        }
        Ok(())
    }
}

impl AttributeSet {
    /// No attributes.
    pub const NONE: Self = Self { colours: false, classes: false, times: false };

    /// Returns whether there are none.
    pub fn is_none(self) -> bool {
        self == Self::NONE
    }
}
