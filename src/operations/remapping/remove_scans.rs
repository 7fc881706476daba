use super::completion::complete_earlier;
use super::revision::{Change, Changes};
use super::rework::{MappedAgain, Rework, rework};
use crate::error::{Error, Result};
use crate::mapper::{KeptScanHead, KeptSummary, MapReader, MapView};
use crate::operations::snapshot::delete_snapshot;
use crate::store::{InputRecord, MapPath, SnapshotName, TileStore};
use serde::Serialize;

/// Scans of a map.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ScanSelection {
    /// By their numbers in the map, first and last.
    Numbers(u64, u64),
    /// By their time stamps in nanoseconds, first and last.
    Time(i64, i64),
    /// By the input that they came from, as the map names it.
    Input(String),
}

/// What was removed.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ScansRemoved {
    /// What was mapped again; nothing where the map kept none of them any more.
    #[serde(flatten)]
    pub mapped: MappedAgain,
    /// Scans that are gone from the map.
    pub scans_removed: u64,
    /// Files with removed scans that an earlier, interrupted removal left and that this call removed. 0 if this call
    /// removed scans itself.
    pub files_removed: u64,
    /// Snapshots that still hold some of them.
    pub snapshots_with_them: Vec<SnapshotName>,
    /// Snapshots that held some of them and were deleted.
    pub snapshots_deleted: Vec<SnapshotName>,
    /// Snapshots that may still hold some of them: they could not be read, or not be deleted.
    pub snapshots_failed: Vec<SnapshotFailure>,
}

/// A snapshot that could not be read or deleted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct SnapshotFailure {
    /// Its name.
    pub name: SnapshotName,
    /// Why, and what to do.
    pub reason: String,
}

/// Takes scans out of a map, as if they had never been inserted, and their points out of its files. They keep their
/// numbers, which no other scan gets.
///
/// A removal that was killed after it had changed the map is completed by the same call, as by the next process that
/// opens the map for writing: the files of the removed scans go. A call whose scans were removed before succeeds and
/// removes no scan; of times that the map has none of, nothing tells whether it had, unless files are left.
///
/// Snapshots stay what they are, with what they hold of these scans, unless `from_snapshots`: then those that hold any
/// are deleted, one by one after the scans are gone from the map. Where that was interrupted, or is asked for later,
/// the same call deletes those that are left. `progress` is told the scans done and all.
///
/// # Errors
///
/// As for [`remap`](super::remap()); no scan that is selected; a disk that refuses to remove files of scans that are no
/// longer in the map, which the same call tries again. A snapshot that cannot be read or deleted is an error only if
/// nothing was done: else it is in [`ScansRemoved::snapshots_failed`].
pub fn remove_scans(
    map: impl Into<MapPath>,
    scans: &ScanSelection,
    from_snapshots: bool,
    how: &Rework,
    progress: impl FnMut(u64, u64),
) -> Result<ScansRemoved> {
    let (disk, folder) = map.into().into_parts();
    let path = || MapPath::on(disk.clone(), &folder);
    let (mut removed, is_repeated) = remove_from_map(path, scans, from_snapshots, how, progress)?;
    let (mut first_error, is_to_go) = (None, from_snapshots && !how.is_dry_run);
    for name in TileStore::open_read_only(disk.clone(), &folder)?.snapshots().names()? {
        // The one that was asked for keeps them.
        let is_to_go = is_to_go && how.keep_as.as_ref() != Some(&name);
        if let Err(error) = removed.look_at_snapshot(path, name.clone(), scans, is_to_go) {
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

/// Takes the scans out of the map itself. Where only snapshots hold any, and these are to go, the map stays. Also
/// returns whether an earlier call did it.
fn remove_from_map(
    path: impl Fn() -> MapPath,
    scans: &ScanSelection,
    from_snapshots: bool,
    how: &Rework,
    progress: impl FnMut(u64, u64),
) -> Result<(ScansRemoved, bool)> {
    let reader = MapReader::open(path(), 0)?;
    let (summary, selection) = (reader.kept_summary()?, Selection::of(scans, &reader));
    let changes = selection.removals(&summary);
    let refusal = none_selected(scans, &reader);
    // A reader would have the tables kept that the removal replaces.
    drop(reader);
    let was_removed = selection.has_removed(&summary);
    if !changes.is_empty() || !from_snapshots && !was_removed {
        summary.check_keeps_all()?;
    }
    if !changes.is_empty() {
        let scans_removed = changes.len() as u64;
        let mapped = rework(&summary, changes, how, progress)?;
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
    /// Notes a snapshot that holds any of the scans, and deletes it if it is to go.
    fn look_at_snapshot(
        &mut self,
        path: impl Fn() -> MapPath,
        name: SnapshotName,
        scans: &ScanSelection,
        is_to_go: bool,
    ) -> Result<()> {
        if !holds_any(path(), &name, scans).map_err(may_hold_some)? {
            return Ok(());
        }
        if is_to_go {
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

/// A selection that needs no list of inputs any more: that of a map or of one of its snapshots.
enum Selection {
    Numbers(Vec<(u64, u64)>),
    Time(i64, i64),
}

impl Selection {
    fn of(scans: &ScanSelection, reader: &MapReader) -> Self {
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

    /// The removal of each scan that is kept and selected.
    fn removals(&self, scans: &KeptSummary) -> Changes {
        let selected = scans.scans().iter().filter(|scan| self.has(scan));
        selected.map(|scan| (scan.number, Change::Remove)).collect()
    }

    /// Whether it has numbers of scans that were removed before; of times nothing tells.
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

/// The numbers of the scans of an input, first and last; the map may have gone back to it later.
fn ranges_of(name: &str, inputs: &[InputRecord], scan_number: u64) -> Vec<(u64, u64)> {
    let ends = inputs.iter().skip(1).map(|next| next.first_scan).chain([scan_number]);
    let of_inputs = inputs.iter().zip(ends).filter(|(input, _)| input.is_named(name));
    of_inputs.map(|(input, end)| (input.first_scan + 1, end)).collect()
}

/// The error of a selection that has no scan.
fn none_selected(scans: &ScanSelection, reader: &MapReader) -> Error {
    let described = match scans {
        ScanSelection::Numbers(first, last) => format!("with numbers from {first} to {last}"),
        ScanSelection::Time(first, last) => format!("from {first} to {last} ns"),
        ScanSelection::Input(name) => {
            let names: Vec<_> = inputs_of(reader).iter().map(|input| &*input.name).collect();
            if !names.contains(&&**name) {
                let reason = format!("the map has none of {name:?}; it has {}", names.join(", "));
                return Error::argument("input", reason);
            }
            format!("of input {name:?}")
        }
    };
    Error::argument("scans", format!("the map keeps none {described}"))
}

/// Whether a snapshot keeps any of these scans.
fn holds_any(map: MapPath, name: &SnapshotName, scans: &ScanSelection) -> Result<bool> {
    let past = MapReader::open_snapshot(map, name, 0)?;
    let selection = Selection::of(scans, &past);
    Ok(past.kept_summary()?.scans().iter().any(|scan| selection.has(scan)))
}

/// The error of a snapshot that cannot be read, with what to do about it.
fn may_hold_some(error: Error) -> Error {
    match error {
        Error::Damaged { path, tile, mut cause } => {
            cause.reason.push_str(
                "; this snapshot may hold some of the scans that are to go: delete it, or repair the map, and run \
                 this again",
            );
            Error::Damaged { path, tile, cause }
        }
        other => other,
    }
}
