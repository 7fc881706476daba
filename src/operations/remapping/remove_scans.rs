use super::change::{Change, Changes};
use super::completion::complete_earlier;
use super::replay::{Replay, Replayed, replay};
use crate::error::{Error, Result};
use crate::mapper::{KeptScanHead, KeptSummary, MapReader, MapView};
use crate::operations::snapshot::delete_snapshot;
use crate::store::{InputRecord, MapPath, SnapshotName, TileStore};
use serde::Serialize;

/// Selection of scans of a map.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ScanSelection {
    /// First and last number of the scans in the map.
    Numbers(u64, u64),
    /// First and last time stamp in nanoseconds.
    Time(i64, i64),
    /// Name of their input in the map.
    Input(String),
}

/// Result of [`remove_scans`].
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ScansRemoved {
    /// Counts of the replay; all 0 if the map kept none of the scans any more.
    #[serde(flatten)]
    pub mapped: Replayed,
    /// Number of scans removed from the map.
    pub scans_removed: u64,
    /// Number of files with removed scans that an interrupted removal left and that this call removed. 0 if this call
    /// removed scans itself.
    pub files_removed: u64,
    /// Snapshots that still contain some of the scans.
    pub snapshots_with_them: Vec<SnapshotName>,
    /// Snapshots that contained some of the scans and were deleted.
    pub snapshots_deleted: Vec<SnapshotName>,
    /// Snapshots that could not be read or deleted, and may still contain some of the scans.
    pub snapshots_failed: Vec<SnapshotFailure>,
}

/// A snapshot that could not be read or deleted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct SnapshotFailure {
    /// Name of the snapshot.
    pub name: SnapshotName,
    /// Reason and remedy.
    pub reason: String,
}

/// Removes scans from a map, as if they had never been inserted, and their points from its files. Their numbers are not
/// reused.
///
/// If a removal was killed after its commit, the same call, or the next process that opens the map for writing, removes
/// the remaining files. A call whose scans were removed before succeeds and removes no scan. The map does not record
/// the times of removed scans. For a time range without scans, a call therefore recognises an earlier removal only if
/// files of it remain.
///
/// Snapshots are unchanged and keep these scans, unless `from_snapshots` is set: then those that contain any of the
/// scans are deleted individually, after the scans are removed from the map. After an interruption, or at any later
/// time, the same call deletes the rest. `progress` receives the number of scans done and in total.
///
/// # Errors
///
/// As for [`remap`](super::remap()); no selected scan; an I/O error while removing files of scans that are no longer in
/// the map, which the same call retries. A snapshot that cannot be read or deleted is an error only if nothing was
/// done. Otherwise it is listed in [`ScansRemoved::snapshots_failed`].
pub fn remove_scans(
    map: impl Into<MapPath>,
    scans: &ScanSelection,
    from_snapshots: bool,
    how: &Replay,
    progress: impl FnMut(u64, u64),
) -> Result<ScansRemoved> {
    let (disk, folder) = map.into().into_parts();
    let path = || MapPath::on(disk.clone(), &folder);
    let (mut removed, is_repeated) = remove_from_map(path, scans, from_snapshots, how, progress)?;
    let (mut first_error, deletes) = (None, from_snapshots && !how.is_dry_run);
    for name in TileStore::open_read_only(disk.clone(), &folder)?.snapshots().names()? {
        // The snapshot `keep_as` is kept, although it contains the scans.
        let deletes = deletes && how.keep_as.as_ref() != Some(&name);
        if let Err(error) = removed.handle_snapshot(path, name.clone(), scans, deletes) {
            removed.snapshots_failed.push(SnapshotFailure { name, reason: format!("{error:#}") });
            first_error.get_or_insert(error);
        }
    }
    let has_done_any =
        removed.scans_removed + removed.files_removed > 0 || !removed.snapshots_deleted.is_empty();
    match first_error {
        Some(error) if !has_done_any => return Err(error),
        Some(_) => return Ok(removed),
        None => {}
    }
    if removed.scans_removed == 0 && !is_repeated && !removed.has_found_snapshots() {
        return Err(none_selected(scans, &MapReader::open(path(), 0)?));
    }
    Ok(removed)
}

/// Removes the scans from the map itself. If only snapshots contain them, and these are to be deleted, the map is
/// unchanged. Also returns whether an earlier call has removed the scans.
fn remove_from_map(
    path: impl Fn() -> MapPath,
    scans: &ScanSelection,
    from_snapshots: bool,
    how: &Replay,
    progress: impl FnMut(u64, u64),
) -> Result<(ScansRemoved, bool)> {
    let reader = MapReader::open(path(), 0)?;
    let (summary, selection) = (reader.kept_summary()?, Selection::of(scans, &reader));
    let changes = selection.removals(&summary);
    let refusal = none_selected(scans, &reader);
    // Close the reader before the replay: replaced tables would be kept for it.
    drop(reader);
    let was_removed = selection.has_removed(&summary);
    if !changes.is_empty() || !from_snapshots && !was_removed {
        summary.check_keeps_all()?;
    }
    if !changes.is_empty() {
        let scans_removed = changes.len() as u64;
        let mapped = replay(&summary, changes, how, progress)?;
        return Ok((ScansRemoved { mapped, scans_removed, ..ScansRemoved::default() }, false));
    }
    let (disk, folder) = path().into_parts();
    let files_removed = if how.is_dry_run { 0 } else { complete_earlier(disk, &folder)? };
    let is_repeated = match &selection {
        Selection::Numbers(_) => was_removed,
        // The catalog has no times of removed scans.
        Selection::Time(..) => files_removed > 0,
    };
    match from_snapshots || is_repeated {
        true => Ok((ScansRemoved { files_removed, ..ScansRemoved::default() }, is_repeated)),
        false => Err(refusal),
    }
}

impl ScansRemoved {
    /// Records a snapshot that contains any of the scans, and deletes it if requested.
    fn handle_snapshot(
        &mut self,
        path: impl Fn() -> MapPath,
        name: SnapshotName,
        scans: &ScanSelection,
        deletes: bool,
    ) -> Result<()> {
        if !holds_any(path(), &name, scans).map_err(may_hold_some)? {
            return Ok(());
        }
        if deletes {
            delete_snapshot(path(), &name)?;
            self.snapshots_deleted.push(name);
        } else {
            self.snapshots_with_them.push(name);
        }
        Ok(())
    }

    fn has_found_snapshots(&self) -> bool {
        !(self.snapshots_with_them.is_empty() && self.snapshots_deleted.is_empty())
    }
}

/// Selection with the numbers of inputs resolved, for a map or one of its snapshots.
pub(super) enum Selection {
    Numbers(Vec<(u64, u64)>),
    Time(i64, i64),
}

impl Selection {
    pub(super) fn of(scans: &ScanSelection, reader: &MapReader) -> Self {
        match scans {
            ScanSelection::Numbers(first, last) => Self::Numbers(vec![(*first, *last)]),
            ScanSelection::Time(first, last) => Self::Time(*first, *last),
            ScanSelection::Input(name) => {
                Self::Numbers(ranges_of(name, inputs_of(reader), reader.scan_number()))
            }
        }
    }

    fn has(&self, scan: &KeptScanHead) -> bool {
        match self {
            Self::Numbers(ranges) => {
                ranges.iter().any(|&(first, last)| (first..=last).contains(&scan.number))
            }
            Self::Time(first, last) => scan.stamp_ns.is_some_and(|stamp| (*first..=*last).contains(&stamp)),
        }
    }

    pub(super) fn removals(&self, scans: &KeptSummary) -> Changes {
        let selected = scans.scans().iter().filter(|scan| self.has(scan));
        selected.map(|scan| (scan.number, Change::Remove)).collect()
    }

    /// Returns whether the selection includes numbers of removed scans. False for times: those of removed scans are not
    /// recorded.
    fn has_removed(&self, scans: &KeptSummary) -> bool {
        let Self::Numbers(ranges) = self else { return false };
        scans
            .removed()
            .iter()
            .any(|&(first, last)| ranges.iter().any(|&(from, to)| from <= last && first <= to))
    }
}

fn inputs_of(reader: &MapReader) -> &[InputRecord] {
    reader.metadata().ext.as_ref().map_or(&[], |ext| &ext.inputs)
}

/// Returns the first and last scan numbers of an input. A map can have several ranges of one input.
fn ranges_of(name: &str, inputs: &[InputRecord], scan_number: u64) -> Vec<(u64, u64)> {
    let ends = inputs.iter().skip(1).map(|next| next.first_scan).chain([scan_number]);
    let of_inputs = inputs.iter().zip(ends).filter(|(input, _)| input.is_named(name));
    of_inputs.map(|(input, end)| (input.first_scan + 1, end)).collect()
}

/// Returns the error of a selection without scans.
fn none_selected(scans: &ScanSelection, reader: &MapReader) -> Error {
    let described = match scans {
        ScanSelection::Numbers(first, last) => format!("with numbers from {first} to {last}"),
        ScanSelection::Time(first, last) => format!("from {first} to {last} ns"),
        ScanSelection::Input(name) => {
            let names: Vec<_> = inputs_of(reader).iter().map(|input| &*input.name).collect();
            if !names.contains(&&**name) {
                let reason = format!("the map has no input {name:?}; its inputs are {}", names.join(", "));
                return Error::argument("input", reason);
            }
            format!("of input {name:?}")
        }
    };
    Error::argument("scans", format!("the map keeps none {described}"))
}

fn holds_any(map: MapPath, name: &SnapshotName, scans: &ScanSelection) -> Result<bool> {
    let past = MapReader::open_snapshot(map, name, 0)?;
    let selection = Selection::of(scans, &past);
    Ok(past.kept_summary()?.scans().iter().any(|scan| selection.has(scan)))
}

/// Adds the remedy to the error of an unreadable snapshot.
fn may_hold_some(error: Error) -> Error {
    match error {
        Error::Damaged { path, tile, mut cause } => {
            cause.reason.push_str(
                "; this snapshot may contain scans to be removed: delete it or repair the map and run this again",
            );
            Error::Damaged { path, tile, cause }
        }
        other => other,
    }
}
