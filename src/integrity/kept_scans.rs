use super::finding::Finding;
use super::kept_points::{KeptLocations, WholePoints};
use crate::error::{Error, Result};
use crate::store::{
    CatalogEntry, Disk, KeptAsOf, KeptMarks, KeptRecords, Layout, Salvaged, ScanRecord, SegmentPlace,
    SnapshotName, TileStore, kept_as_of, salvage_entries, whole_fronts,
};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;

/// Catalog of kept scans as of a flush, and the snapshot that needs it; `None` for the map itself.
#[derive(Debug)]
struct Needed {
    as_of: KeptAsOf,
    by: Option<SnapshotName>,
}

/// Checks all scans that a map and its snapshots keep, or with `only` those at some locations. Each catalog and each
/// scan is read once. `found` receives each finding, with the location of its points.
///
/// # Errors
///
/// An I/O error that is not specific to one file.
pub(super) fn check_kept_scans(
    disk: &dyn Disk,
    store: &TileStore,
    only: Option<&KeptLocations>,
    whole: &mut WholePoints,
    found: &mut dyn FnMut(Finding, Option<SegmentPlace>),
) -> Result<()> {
    let layout = store.layout();
    let mut check = Check { disk, layout, only, whole, reported: KeptLocations::default(), found };
    for needed in needed_catalogs(store)? {
        check.read(needed)?;
    }
    Ok(())
}

/// Returns the catalogs that a map and its snapshots need. Versions of one catalog are in one list, the longest first.
fn needed_catalogs(store: &TileStore) -> Result<Vec<Vec<Needed>>> {
    let (mut unnamed, mut named) = (Vec::new(), BTreeMap::<u64, Vec<Needed>>::new());
    let mut add = |as_of: KeptAsOf, by: Option<SnapshotName>| match as_of.catalog {
        Some(catalog) => named.entry(catalog.generation).or_default().push(Needed { as_of, by }),
        None => unnamed.push(vec![Needed { as_of, by }]),
    };
    if store.archive().is_on() {
        add(store.archive().last_commit(), None);
    }
    for name in store.snapshots().names().unwrap_or_default() {
        // The check of the snapshots reports unreadable ones.
        if let Ok(snapshot) = store.snapshots().read(&name)
            && let Some(as_of) = kept_as_of(&snapshot)
        {
            add(as_of, Some(name));
        }
    }
    for catalogs in named.values_mut() {
        catalogs.sort_by_key(|needed| std::cmp::Reverse(needed.as_of.catalog.map(|catalog| catalog.bytes)));
    }
    unnamed.extend(named.into_values());
    Ok(unnamed)
}

struct Check<'a> {
    disk: &'a dyn Disk,
    layout: &'a Layout,
    only: Option<&'a KeptLocations>,
    whole: &'a mut WholePoints,
    /// Damaged points that were reported already.
    reported: KeptLocations,
    found: &'a mut dyn FnMut(Finding, Option<SegmentPlace>),
}

impl Check<'_> {
    fn read(&mut self, catalogs: Vec<Needed>) -> Result<()> {
        let fronts: Vec<_> = catalogs.iter().filter_map(|needed| needed.as_of.catalog).collect();
        let are_whole = whole_fronts(self.disk, self.layout, &fronts);
        let mut is_read = false;
        for (at, needed) in catalogs.iter().enumerate() {
            let is_whole = are_whole.get(at).copied().unwrap_or(false);
            // The shorter version was read as a part of a longer one.
            if is_whole && is_read {
                continue;
            }
            match self.read_scans(needed) {
                Ok(()) => is_read = is_whole,
                Err(error) => self.report(error, needed, None)?,
            }
        }
        Ok(())
    }

    fn read_scans(&mut self, needed: &Needed) -> Result<()> {
        let mut records = KeptRecords::open(self.disk, self.layout, needed.as_of)?;
        while let Some(scan) = records.next_kept()? {
            if self.only.is_some_and(|only| !only.contains(scan.place)) || self.reported.contains(scan.place)
            {
                continue;
            }
            let of_points = self.whole.check(self.disk, self.layout, &scan);
            let of_marks = self.whole.check_marks(self.disk, self.layout, &scan);
            for error in [of_points, of_marks].into_iter().filter_map(Result::err) {
                self.reported.insert(scan.place);
                self.report(error, needed, Some((scan.number, scan.place)))?;
            }
        }
        Ok(())
    }

    fn report(&mut self, error: Error, needed: &Needed, scan: Option<(u64, SegmentPlace)>) -> Result<()> {
        let mut finding = Finding::of(error)?;
        if let Some((number, _)) = scan {
            finding.reason += &format!(" (scan {number})");
        }
        if let Some(name) = &needed.by {
            finding.reason += &format!("; the snapshot {name} needs it");
        }
        (self.found)(finding, scan.map(|(_, place)| place));
        Ok(())
    }
}

/// Returns files of kept scans that neither the last flush nor a snapshot needs. A writer may have committed since
/// `store` was opened, so candidates are checked a second time. Returns none if a catalog or a snapshot is damaged,
/// because it may need any file.
///
/// # Errors
///
/// An I/O error that is not specific to one file.
pub(super) fn find_idle(disk: &Arc<dyn Disk>, store: &TileStore) -> Result<Vec<PathBuf>> {
    let idle_in = |store: &TileStore| -> Result<Vec<PathBuf>> {
        match store.snapshots().idle_scan_files() {
            Err(Error::Damaged { .. }) => Ok(Vec::new()),
            Err(error) if Finding::is_of_file(&error) => Ok(Vec::new()),
            idle => Ok(idle?.unwrap_or_default()),
        }
    };
    let mut idle = idle_in(store)?;
    if !idle.is_empty() {
        // If the map cannot be opened now, it is being changed.
        let now = TileStore::open_read_only(disk.clone(), store.folder()).ok();
        let idle_now = now.as_ref().map(idle_in).transpose()?.unwrap_or_default();
        idle.retain(|path| idle_now.contains(path));
    }
    Ok(idle)
}

/// Intact part of the scans that a map keeps.
#[derive(Debug, Default)]
pub(super) struct WholeEntries {
    /// Errors of the damaged part.
    pub damage: Vec<Error>,
    /// Number of scans from which the map can no longer be replayed.
    pub scans_lost: u64,
    /// Number of other scans whose marks of moving points are lost.
    pub marks_lost: u64,
    /// Segments of the intact scans.
    pub segments: BTreeSet<u64>,
}

/// Passes the entries of a repaired catalog to `put`: a scan with damaged points becomes a scan without points, one with
/// damaged marks has unknown marks, and a scan with a damaged record becomes an unlisted one.
///
/// # Errors
///
/// An I/O error that is not specific to one file, and errors of `put`.
pub(super) fn whole_entries(
    disk: &dyn Disk,
    layout: &Layout,
    as_of: KeptAsOf,
    points: &mut WholePoints,
    mut put: impl FnMut(&CatalogEntry) -> Result<()>,
) -> Result<WholeEntries> {
    let mut whole = WholeEntries::default();
    let damage = salvage_entries(disk, layout, as_of, &mut |entry| {
        let entry = match entry {
            Salvaged::Lost(entry) => {
                whole.scans_lost += entry.numbers().map_or(0, |(first, last)| last - first + 1);
                entry
            }
            Salvaged::Whole(CatalogEntry::Kept(mut scan)) => match points.check(disk, layout, &scan) {
                Ok(()) => {
                    if let Err(error) = points.check_marks(disk, layout, &scan) {
                        whole.damage.push(only_damage(error)?);
                        whole.marks_lost += 1;
                        scan.moving = scan.moving.map(|marks| KeptMarks { place: None, ..marks });
                    }
                    whole.segments.extend(scan.places().map(|place| place.segment));
                    CatalogEntry::Kept(scan)
                }
                Err(error) => {
                    whole.damage.push(only_damage(error)?);
                    whole.scans_lost += 1;
                    CatalogEntry::Listed(ScanRecord::new(scan.number, scan.stamp_ns, scan.origin_m()))
                }
            },
            Salvaged::Whole(entry) => entry,
        };
        put(&entry)
    })?;
    whole.damage.extend(damage);
    Ok(whole)
}

/// Counts the kept scans in the newest catalog of a map, committed or not.
///
/// # Errors
///
/// An I/O error that is not specific to one file.
pub(super) fn count_kept(disk: &dyn Disk, layout: &Layout) -> Result<u64> {
    let mut count = 0;
    salvage_entries(disk, layout, KeptAsOf::NEWEST, &mut |entry| {
        count += u64::from(matches!(entry, Salvaged::Whole(CatalogEntry::Kept(_))));
        Ok(())
    })?;
    Ok(count)
}

/// Returns the error as `Ok` if it is specific to one file.
fn only_damage(error: Error) -> Result<Error> {
    match matches!(error, Error::Damaged { .. }) || Finding::is_of_file(&error) {
        true => Ok(error),
        false => Err(error),
    }
}
