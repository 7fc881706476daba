use crate::error::Result;
use crate::persistence::{check_points, read_marks};
use crate::store::{Disk, KeptRecord, Layout, SegmentPlace};
use std::collections::{BTreeMap, BTreeSet};

/// Segment, offset and length of points in bytes.
type Location = (u64, u64, u64);

fn location_of(place: SegmentPlace) -> Location {
    (place.segment, place.offset, place.bytes)
}

#[derive(Debug, Default)]
pub(super) struct KeptLocations(BTreeSet<Location>);

impl KeptLocations {
    pub(super) fn insert(&mut self, place: SegmentPlace) {
        self.0.insert(location_of(place));
    }

    pub(super) fn contains(&self, place: SegmentPlace) -> bool {
        self.0.contains(&location_of(place))
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// Points and marks that were read and are intact, so that what a map and its snapshots share is read once.
#[derive(Debug, Default)]
pub(super) struct WholePoints {
    points: WholeRanges,
    marks: WholeRanges,
}

impl WholePoints {
    /// Checks the points of a scan, if they were not checked before.
    ///
    /// # Errors
    ///
    /// Damage or an I/O error.
    pub(super) fn check(&mut self, disk: &dyn Disk, layout: &Layout, scan: &KeptRecord) -> Result<()> {
        self.points.check_once(scan.place, || check_points(disk, layout, scan))
    }

    /// Checks the marks of a scan, if it has any and they were not checked before.
    ///
    /// # Errors
    ///
    /// Damage or an I/O error.
    pub(super) fn check_marks(&mut self, disk: &dyn Disk, layout: &Layout, scan: &KeptRecord) -> Result<()> {
        let Some(place) = scan.moving.and_then(|marks| marks.place) else { return Ok(()) };
        self.marks.check_once(place, || read_marks(disk, layout, scan).map(drop))
    }
}

/// Intact ranges of segments. Scans are contiguous, so there are few.
#[derive(Debug, Default)]
struct WholeRanges {
    /// End of each range, by segment and start.
    ranges: BTreeMap<(u64, u64), u64>,
}

impl WholeRanges {
    fn check_once(&mut self, place: SegmentPlace, check: impl FnOnce() -> Result<()>) -> Result<()> {
        let SegmentPlace { segment, offset, bytes } = place;
        let end = offset.saturating_add(bytes);
        let before = self.ranges.range(..=(segment, offset)).next_back().map(|(&range, &end)| (range, end));
        let before = before.filter(|&((of, _), _)| of == segment);
        if bytes > 0 && before.is_some_and(|(_, known_end)| known_end >= end) {
            return Ok(());
        }
        check()?;
        let begin = match before {
            Some((range, known_end)) if known_end == offset => range,
            _ => (segment, offset),
        };
        self.ranges.insert(begin, end);
        if let Some(next_end) = self.ranges.remove(&(segment, end)) {
            self.ranges.insert(begin, next_end);
        }
        Ok(())
    }
}
