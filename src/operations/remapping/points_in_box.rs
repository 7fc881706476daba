use super::change::{Change, Changes};
use super::filtered_scan::FilteredScan;
use crate::error::{Error, Result};
use crate::mapper::{KeptSummary, MapReader};
use crate::scan::{ScanPoints, Stop};
use crate::space::Aabb;
use crate::store::MapPath;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;
use std::path::Path;

/// Kept scans with points in a box: the search for [`remove_found_points`](super::remove_found_points()), which several
/// processes can share.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PointsInBox {
    /// Flush of the map that was searched.
    flush_number: u64,
    /// Lower and upper corner in metres, as the bits of floating-point numbers: text would round them.
    corners: [[u64; 3]; 2],
    /// First and last number of each range of scans that were searched.
    searched: Vec<(u64, u64)>,
    /// Number of each scan with points in the box, and their count.
    scans: Vec<(u64, u64)>,
}

impl PointsInBox {
    /// Searches the scans with these numbers. The box is in metres in the world frame, and excludes its upper faces.
    ///
    /// # Errors
    ///
    /// An invalid box; a map that keeps no scans or has other scans too; [`Error::Changed`] if it was flushed since
    /// `scans` was read; damage; an I/O error; a request to stop.
    pub fn search(
        scans: &KeptSummary,
        region: &Aabb,
        numbers: RangeInclusive<u64>,
        stop: &Stop,
    ) -> Result<Self> {
        let (disk, folder) = scans.place();
        check_box(region, folder)?;
        scans.check_keeps_all()?;
        let reader = MapReader::open(MapPath::on(disk, folder), 0)?;
        if reader.flush_number() != scans.flush_number() {
            return Err(Error::Changed { path: folder.to_owned() });
        }
        let mut found = Self {
            flush_number: reader.flush_number(),
            corners: [region.min, region.max].map(|corner| corner.map(f64::to_bits)),
            searched: vec![(*numbers.start(), *numbers.end())],
            scans: Vec::new(),
        };
        let mut kept = reader.kept_scans()?;
        while let Some(record) = kept.next_record()? {
            stop.check()?;
            if !numbers.contains(&record.number) {
                continue;
            }
            let scan = kept.open(record)?;
            let points = FilteredScan::new(&scan, *region, true)?.len() as u64;
            if points > 0 {
                found.scans.push((scan.number(), points));
            }
        }
        Ok(found)
    }

    /// Joins searches of different scans.
    ///
    /// # Errors
    ///
    /// No search, or searches of different boxes or flushes.
    pub fn joined(searches: impl IntoIterator<Item = Self>) -> Result<Self> {
        let mut searches = searches.into_iter();
        let Some(mut all) = searches.next() else {
            return Err(Error::argument("searches", "pass one or more"));
        };
        for search in searches {
            if search.corners != all.corners {
                return Err(Error::argument("searches", "are of different boxes"));
            }
            if search.flush_number != all.flush_number {
                return Err(Error::argument("searches", "are of different flushes: search again"));
            }
            all.searched.extend(search.searched);
            all.scans.extend(search.scans);
        }
        all.searched.sort_unstable();
        all.scans.sort_unstable();
        all.scans.dedup();
        Ok(all)
    }

    /// Number of points in the box.
    pub fn points(&self) -> u64 {
        self.scans.iter().map(|(_, points)| points).sum()
    }

    /// The box in metres.
    pub fn region(&self) -> Aabb {
        let [min, max] = self.corners.map(|corner| corner.map(f64::from_bits));
        Aabb { min, max }
    }

    /// Returns the changes of the scans of a map.
    ///
    /// # Errors
    ///
    /// [`Error::Changed`] if the map was flushed since the search; a scan that was not searched, or one that the map does
    /// not keep.
    pub(super) fn changes(&self, scans: &KeptSummary) -> Result<Changes> {
        let (region, mut ranges) = (self.region(), self.searched.iter().peekable());
        let (_, folder) = scans.place();
        check_box(&region, folder)?;
        if self.flush_number != scans.flush_number() {
            return Err(Error::Changed { path: folder.to_owned() });
        }
        let mut changes: Changes =
            self.scans.iter().map(|(number, _)| (*number, Change::Filter(region))).collect();
        let mut found = 0;
        for scan in scans.scans() {
            while ranges.next_if(|(_, last)| *last < scan.number).is_some() {}
            if ranges.peek().is_none_or(|(first, _)| *first > scan.number) {
                let reason = format!("scan {} was not searched: pass the searches of all scans", scan.number);
                return Err(Error::argument("searches", reason));
            }
            found += usize::from(changes.contains_key(&scan.number));
        }
        if found < changes.len() {
            scans.scans().iter().for_each(|scan| drop(changes.remove(&scan.number)));
            let number = changes.keys().min().copied().unwrap_or_default();
            return Err(Error::argument("searches", format!("the map keeps no scan {number}")));
        }
        Ok(changes)
    }
}

pub(super) fn check_box(region: &Aabb, map: &Path) -> Result<()> {
    let is_box = (0..3).all(|axis| region.min[axis] < region.max[axis]);
    if is_box {
        return Ok(());
    }
    let reason = format!("not a box (map {}); give the lower corner first", map.display());
    Err(Error::argument("region", reason))
}
