use super::finding::Finding;
use crate::error::{Error, Result};
use crate::store::{CatalogEntry, Disk, KeptRecords, Layout, ScanRecord, TileStore, check_points};
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

/// Passes on the entries of the catalog as it should be, where any of it is damaged: a scan with damaged points is one
/// whose points are not kept. Returns what is damaged.
///
/// # Errors
///
/// A disk that refuses more than single files; errors of `put`.
pub(super) fn whole_entries(
    disk: &dyn Disk,
    layout: &Layout,
    records: Result<KeptRecords>,
    scan_number: u64,
    mut put: impl FnMut(&CatalogEntry) -> Result<()>,
) -> Result<Vec<Error>> {
    let (mut damage, mut last) = (Vec::new(), 0);
    let mut records = match records {
        Ok(records) => Some(records),
        Err(error) => {
            damage.push(only_damage(error)?);
            None
        }
    };
    while let Some(open) = &mut records {
        let entry = match open.next_entry() {
            Ok(Some(entry)) => entry,
            Ok(None) => break,
            Err(error) => {
                damage.push(only_damage(error)?);
                break;
            }
        };
        last = entry.numbers().map_or(last, |(_, last)| last);
        match &entry {
            CatalogEntry::Kept(scan) => match check_points(disk, layout, scan) {
                Ok(()) => put(&entry)?,
                Err(error) => {
                    damage.push(only_damage(error)?);
                    let listed = ScanRecord::new(scan.number, scan.stamp_ns, scan.origin_m());
                    put(&CatalogEntry::Listed(listed))?;
                }
            },
            entry => put(entry)?,
        }
    }
    if last < scan_number {
        put(&CatalogEntry::Unlisted(last + 1, scan_number))?;
    }
    Ok(damage)
}

/// The error, if it is about a file by itself.
fn only_damage(error: Error) -> Result<Error> {
    match matches!(error, Error::Damaged { .. }) || Finding::is_of_file(&error) {
        true => Ok(error),
        false => Err(error),
    }
}
