use super::MapReader;
use super::kept_scan::pose_of_numbers;
use crate::error::{Error, Result};
use crate::scan::{Pose, Sweep};
use crate::store::{CatalogEntry, Disk, KeptFrame, KeptRecord, MapPath};
use rustc_hash::FxHashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Summary of the scans that a map keeps as of one flush, without points and tiles: a few hundred bytes per scan.
///
/// Operations that change scans are planned with it. It is read in one pass over the catalog. An operation fails with
/// [`Error::Changed`] if the map was flushed since.
#[derive(Clone, Debug)]
pub struct KeptSummary {
    disk: Arc<dyn Disk>,
    folder: PathBuf,
    flush_number: u64,
    /// Generation of the catalog that was read.
    catalog: Option<u64>,
    heads: Vec<KeptScanHead>,
    /// Motions of the sensor during scans, by their numbers.
    sweeps: FxHashMap<u64, Arc<Sweep>>,
    /// First and last numbers of removed scans.
    removed: Vec<(u64, u64)>,
    /// Reason why the map cannot be replayed from its scans.
    refusal: Option<String>,
}

/// Summary of one kept scan, without points and tiles.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct KeptScanHead {
    /// Scan number in the map, from 1.
    pub number: u64,
    /// Acquisition time in nanoseconds since the epoch of the source, if known.
    pub stamp_ns: Option<i64>,
    /// Sensor pose; `None` if the points are in the world frame, where no pose applies.
    pub world_from_sensor: Option<Pose>,
    /// Pose of the sensor in the body frame that the trajectory describes, if known: position in metres, then quaternion x,
    /// y, z, w.
    pub body_from_sensor: Option<[f64; 7]>,
    /// Number of voxel updates when the scan was inserted; a voxel updated twice counts twice.
    pub updates: u64,
    /// Number of points.
    pub points: u64,
    /// Number of points that are marked as moving.
    pub moving_points: u64,
    /// Whether it is unknown which points these are, because `repair` found the marks damaged.
    pub has_lost_marks: bool,
    /// Segments that contain its points and marks.
    pub(crate) segments: [u64; 2],
}

/// Error text for a map without kept scans.
const NOT_KEPT: &str = "keeps no scans and cannot be replayed; build it with `keep_scans`";

impl KeptSummary {
    /// Reads the summary of a map.
    ///
    /// # Errors
    ///
    /// Fails if there is no map, it is damaged, a read fails or the map keeps no scans.
    pub fn read(map: impl Into<MapPath>) -> Result<Self> {
        MapReader::open(map, 0)?.kept_summary()
    }

    /// Reads the summary from an open map and passes each record to `each`.
    pub(super) fn of(map: &MapReader, mut each: impl FnMut(&KeptRecord) -> Result<()>) -> Result<Self> {
        let mut summary = Self {
            disk: map.disk(),
            folder: map.folder().to_owned(),
            flush_number: map.flush_number(),
            catalog: None,
            heads: Vec::new(),
            sweeps: FxHashMap::default(),
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
                    if let Some(sweep) = &record.sweep {
                        summary.sweeps.insert(record.number, sweep.clone());
                    }
                    summary.heads.push(KeptScanHead::of(record));
                }
                CatalogEntry::Removed(first, last) => summary.removed.push((*first, *last)),
                _ if summary.refusal.is_none() => summary.refusal = no_kept_scan(&entry),
                _ => {}
            }
        }
        Ok(summary)
    }

    /// Checks that the map consists of kept scans only, so that it can be replayed.
    ///
    /// # Errors
    ///
    /// Fails if the map has other content. The error names this content.
    pub fn check_keeps_all(&self) -> Result<()> {
        match &self.refusal {
            None => Ok(()),
            Some(reason) => Err(Error::argument(self.folder.display().to_string(), reason.clone())),
        }
    }

    /// Checks that the marks of moving points of all scans are known, except of those whose marks are no longer needed.
    ///
    /// # Errors
    ///
    /// Fails if `repair` found the marks of another scan damaged: replayed tiles would not match the others.
    pub(crate) fn check_marks(&self, is_renewed: impl Fn(u64) -> bool) -> Result<()> {
        let lost = self.heads.iter().find(|scan| scan.has_lost_marks && !is_renewed(scan.number));
        lost.map_or(Ok(()), |scan| {
            let reason = format!(
                "the marks of moving points of scan {} are lost to damage; mark the moving points again (`voxtile \
                 clean`), or remove all marks (`voxtile clean --undo`)",
                scan.number
            );
            Err(Error::argument(self.folder.display().to_string(), reason))
        })
    }

    /// The kept scans, in order.
    pub fn scans(&self) -> &[KeptScanHead] {
        &self.heads
    }

    /// Motion of the sensor during a scan, if its points have times.
    pub fn sweep(&self, number: u64) -> Option<&Sweep> {
        self.sweeps.get(&number).map(|sweep| &**sweep)
    }

    /// First and last number of each range of removed scans, in order.
    pub fn removed(&self) -> &[(u64, u64)] {
        &self.removed
    }

    /// The number of the flush that was read.
    pub fn flush_number(&self) -> u64 {
        self.flush_number
    }

    /// Disk and folder of the map.
    pub(crate) fn place(&self) -> (Arc<dyn Disk>, &Path) {
        (self.disk.clone(), &self.folder)
    }

    /// Generation of the catalog that was read. New scans extend this catalog; changes of earlier entries create a new
    /// generation.
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
        let KeptRecord { number, stamp_ns, points, updates, place, moving, .. } = *record;
        let of_marks = moving.and_then(|marks| marks.place).map_or(place.segment, |place| place.segment);
        let moving_points = moving.map_or(0, |marks| marks.marked);
        let segments = [place.segment, of_marks];
        let has_lost_marks = record.has_lost_marks();
        Self {
            number,
            stamp_ns,
            world_from_sensor,
            body_from_sensor: record.body_from_sensor,
            updates,
            points,
            moving_points,
            has_lost_marks,
            segments,
        }
    }

    /// Creates a summary of a scan, for tests.
    #[doc(hidden)]
    pub fn new(number: u64, stamp_ns: Option<i64>, world_from_sensor: Option<Pose>) -> Self {
        Self {
            number,
            stamp_ns,
            world_from_sensor,
            body_from_sensor: None,
            updates: 0,
            points: 0,
            moving_points: 0,
            has_lost_marks: false,
            segments: [0; 2],
        }
    }
}

/// Error for a map that keeps no scans.
pub(super) fn keeps_none(folder: &Path) -> Error {
    Error::argument(folder.display().to_string(), NOT_KEPT)
}

/// Returns why a map with this catalog entry cannot be replayed from its kept scans; `None` if it can.
pub(crate) fn no_kept_scan(entry: &CatalogEntry) -> Option<String> {
    let what = match entry {
        CatalogEntry::Kept(_) | CatalogEntry::Removed(..) => return None,
        CatalogEntry::Listed(scan) => format!("scan {}, whose points are not kept", scan.number),
        CatalogEntry::Unlisted(first, last) if first == last => {
            format!("number {first}, which is not a scan")
        }
        CatalogEntry::Unlisted(first, last) => format!("numbers {first} to {last}, which are not scans"),
        CatalogEntry::Operation(what) => format!("a change by another operation: {what}"),
    };
    Some(format!("cannot be replayed from its scans, because it also contains {what}"))
}
