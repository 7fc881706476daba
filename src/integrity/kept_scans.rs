use super::finding::Finding;
use crate::error::{Error, Result};
use crate::store::{
    CatalogEntry, Disk, KeptAsOf, Layout, Salvaged, ScanRecord, TileStore, check_points, salvage_entries,
};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

/// Reads every scan that a map keeps; returns what is damaged.
///
/// # Errors
///
/// A disk that refuses more than single files.
pub(super) fn check_kept_scans(disk: &Arc<dyn Disk>, store: &TileStore) -> Result<Vec<Finding>> {
    let mut findings = Vec::new();
    let mut records = match store.kept_records() {
        Ok(records) => records,
        Err(error) => return Ok(vec![Finding::of(error)?]),
    };
    loop {
        match records.next_kept() {
            Ok(Some(scan)) => {
                if let Err(error) = check_points(&**disk, store.layout(), &scan) {
                    let mut finding = Finding::of(error)?;
                    finding.reason = format!("{} (scan {})", finding.reason, scan.number);
                    findings.push(finding);
                }
            }
            Ok(None) => return Ok(findings),
            Err(error) => {
                findings.push(Finding::of(error)?);
                return Ok(findings);
            }
        }
    }
}

/// The files of scans that neither the last flush nor a snapshot needs. `store` may be behind a writer by now, so they
/// are looked for a second time. None where a catalog or a snapshot is damaged, which may need any.
///
/// # Errors
///
/// A disk that refuses more than single files.
pub(super) fn find_idle(disk: &Arc<dyn Disk>, store: &TileStore) -> Result<Vec<PathBuf>> {
    let idle_in = |store: &TileStore| -> Result<Vec<PathBuf>> {
        match store.idle_scan_files() {
            Err(Error::Damaged { .. }) => Ok(Vec::new()),
            Err(error) if Finding::is_of_file(&error) => Ok(Vec::new()),
            idle => Ok(idle?.unwrap_or_default()),
        }
    };
    let mut idle = idle_in(store)?;
    if !idle.is_empty() {
        // One that cannot be opened any more is being changed.
        let now = TileStore::open_read_only(disk.clone(), store.folder()).ok();
        let idle_now = now.as_ref().map(idle_in).transpose()?.unwrap_or_default();
        idle.retain(|path| idle_now.contains(path));
    }
    Ok(idle)
}

/// What is whole of the scans that a map keeps.
#[derive(Debug, Default)]
pub(super) struct WholeEntries {
    /// What is not.
    pub damage: Vec<Error>,
    /// How many scans the map can no longer be mapped from for it.
    pub scans_lost: u64,
    /// The segments that the others are in.
    pub segments: BTreeSet<u64>,
}

/// Passes on the entries of the catalog as it should be, where any of it is damaged: a scan with damaged points is one
/// whose points are not kept, and one whose record is damaged an unknown one.
///
/// # Errors
///
/// A disk that refuses more than single files; errors of `put`.
pub(super) fn whole_entries(
    disk: &dyn Disk,
    layout: &Layout,
    as_of: KeptAsOf,
    mut put: impl FnMut(&CatalogEntry) -> Result<()>,
) -> Result<WholeEntries> {
    let mut whole = WholeEntries::default();
    let damage = salvage_entries(disk, layout, as_of, &mut |entry| {
        let entry = match entry {
            Salvaged::Lost(entry) => {
                whole.scans_lost += entry.numbers().map_or(0, |(first, last)| last - first + 1);
                entry
            }
            Salvaged::Whole(CatalogEntry::Kept(scan)) => match check_points(disk, layout, &scan) {
                Ok(()) => {
                    whole.segments.insert(scan.place.segment);
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

/// Number of scans in the newest catalog of a map, whether a flush committed it or not.
///
/// # Errors
///
/// A disk that refuses more than single files.
pub(super) fn count_kept(disk: &dyn Disk, layout: &Layout) -> Result<u64> {
    let mut count = 0;
    salvage_entries(disk, layout, KeptAsOf::NEWEST, &mut |entry| {
        count += u64::from(matches!(entry, Salvaged::Whole(CatalogEntry::Kept(_))));
        Ok(())
    })?;
    Ok(count)
}

/// The error, if it is about a file by itself.
fn only_damage(error: Error) -> Result<Error> {
    match matches!(error, Error::Damaged { .. }) || Finding::is_of_file(&error) {
        true => Ok(error),
        false => Err(error),
    }
}
