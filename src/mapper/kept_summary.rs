use super::MapReader;
use super::kept_scan::pose_of_numbers;
use crate::error::{Error, Result};
use crate::scan::Pose;
use crate::store::{CatalogEntry, Disk, KeptFrame, KeptRecord, MapPath};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The scans that a map keeps, as of one flush, without points and tiles: some hundred bytes a scan.
///
/// What changes the scans of a map decides by it. It is read once, in one pass over the catalog; a change is refused
/// with [`Error::Changed`] if the map was flushed since.
#[derive(Clone, Debug)]
pub struct KeptSummary {
    disk: Arc<dyn Disk>,
    folder: PathBuf,
    flush_number: u64,
    /// The catalog that was read.
    catalog: Option<u64>,
    heads: Vec<KeptScanHead>,
    /// First and last numbers of removed scans.
    removed: Vec<(u64, u64)>,
    /// Why the map cannot be mapped again from its scans.
    refusal: Option<String>,
}

/// A scan that a map keeps, without points and tiles.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct KeptScanHead {
    /// Its number in the map, from 1.
    pub number: u64,
    /// When it was taken, in nanoseconds since the epoch of its source, if that is known.
    pub stamp_ns: Option<i64>,
    /// The pose of the sensor; `None` if the points are in the world frame, so that no pose moves them.
    pub world_from_sensor: Option<Pose>,
    /// Voxels that it updated when it was mapped, each as often as it was.
    pub updates: u64,
    /// The segment with its points.
    pub(crate) segment: u64,
}

/// What to do about a map without kept scans.
const NOT_KEPT: &str =
    "keeps no scans, so that it cannot be mapped again; build it with `keep_scans` to have them";

impl KeptSummary {
    /// Reads it from a map.
    ///
    /// # Errors
    ///
    /// No map there, damage, a disk that refuses. A map that keeps no scans is none.
    pub fn read(map: impl Into<MapPath>) -> Result<Self> {
        MapReader::open(map, 0)?.kept_summary()
    }

    /// Reads it from an open map, and shows each record in passing.
    pub(super) fn of(map: &MapReader, mut each: impl FnMut(&KeptRecord) -> Result<()>) -> Result<Self> {
        let mut summary = Self {
            disk: map.disk(),
            folder: map.folder().to_owned(),
            flush_number: map.flush_number(),
            catalog: None,
            heads: Vec::new(),
            removed: Vec::new(),
            refusal: None,
        };
        if !map.keeps_scans() {
            summary.refusal = Some(NOT_KEPT.to_owned());
            return Ok(summary);
        }
        summary.catalog = map.store().archive().generation()?;
        let mut records = map.kept_records()?;
        while let Some(entry) = map.explained(records.next_entry())? {
            match &entry {
                CatalogEntry::Kept(record) => {
                    each(record)?;
                    summary.heads.push(KeptScanHead::of(record));
                }
                CatalogEntry::Removed(first, last) => summary.removed.push((*first, *last)),
                _ if summary.refusal.is_none() => summary.refusal = no_kept_scan(&entry),
                _ => {}
            }
        }
        Ok(summary)
    }

    /// Checks that the map consists of scans that it keeps and of nothing else: only then it can be mapped again.
    ///
    /// # Errors
    ///
    /// What else there is, named.
    pub fn check_keeps_all(&self) -> Result<()> {
        match &self.refusal {
            None => Ok(()),
            Some(reason) => Err(Error::argument(self.folder.display().to_string(), reason.clone())),
        }
    }

    /// The scans, in order.
    pub fn scans(&self) -> &[KeptScanHead] {
        &self.heads
    }

    /// First and last numbers of scans that were removed from the map, in order.
    pub fn removed(&self) -> &[(u64, u64)] {
        &self.removed
    }

    /// The number of the flush that was read.
    pub fn flush_number(&self) -> u64 {
        self.flush_number
    }

    /// Where the map is.
    pub(crate) fn place(&self) -> (Arc<dyn Disk>, &Path) {
        (self.disk.clone(), &self.folder)
    }

    /// The generation of the catalog that was read. Scans add to it; what changes earlier entries makes another one.
    pub(crate) fn catalog(&self) -> Option<u64> {
        self.catalog
    }
}

impl KeptScanHead {
    fn of(record: &KeptRecord) -> Self {
        let world_from_sensor = match &record.frame {
            KeptFrame::Sensor(pose) => Some(pose_of_numbers(pose)),
            KeptFrame::World(_) => None,
        };
        let KeptRecord { number, stamp_ns, updates, place, .. } = *record;
        Self { number, stamp_ns, world_from_sensor, updates, segment: place.segment }
    }

    /// A scan of this number, for tests of what decides by these.
    #[doc(hidden)]
    pub fn new(number: u64, stamp_ns: Option<i64>, world_from_sensor: Option<Pose>) -> Self {
        Self { number, stamp_ns, world_from_sensor, updates: 0, segment: 0 }
    }
}

/// The error of a map that keeps no scans.
pub(super) fn keeps_none(folder: &Path) -> Error {
    Error::argument(folder.display().to_string(), NOT_KEPT)
}

/// Why a map with this entry cannot be mapped again from the scans that it keeps; `None` if it can.
pub(crate) fn no_kept_scan(entry: &CatalogEntry) -> Option<String> {
    let what = match entry {
        CatalogEntry::Kept(_) | CatalogEntry::Removed(..) => return None,
        CatalogEntry::Listed(scan) => format!("scan {}, whose points are not kept", scan.number),
        CatalogEntry::Unlisted(first, last) if first == last => format!("number {first}, which is no scan"),
        CatalogEntry::Unlisted(first, last) => format!("numbers {first} to {last}, which are no scans"),
        CatalogEntry::Operation(what) => format!("a change that is no scan: {what}"),
    };
    Some(format!("cannot be mapped again from its scans, for it also consists of {what}"))
}
