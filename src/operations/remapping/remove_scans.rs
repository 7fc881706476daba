use super::revision::{Fate, MappedAgain, Rework, rework};
use crate::error::{Error, Result};
use crate::mapper::{MapReader, MapView};
use crate::operations::snapshot::delete_snapshot;
use crate::store::{InputRecord, KeptRecord, MapPath, SnapshotName, TileStore};
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
    /// What was mapped again.
    #[serde(flatten)]
    pub mapped: MappedAgain,
    /// Scans that are gone.
    pub scans_removed: u64,
    /// Snapshots that still hold some of them.
    pub snapshots_with_them: Vec<SnapshotName>,
    /// Snapshots that held some of them and were deleted.
    pub snapshots_deleted: Vec<SnapshotName>,
}

/// Takes scans out of a map, as if they had never been inserted, and their points out of its files. They keep their
/// numbers, which no other scan gets.
///
/// Snapshots stay what they are, with what they hold of these scans, unless `from_snapshots`: then those that hold any
/// are deleted. `progress` is told the scans done and all.
///
/// # Errors
///
/// As for [`remap`](super::remap()); no scan that is selected.
pub fn remove_scans(
    map: impl Into<MapPath>,
    scans: &ScanSelection,
    from_snapshots: bool,
    how: &Rework,
    progress: impl FnMut(u64, u64),
) -> Result<ScansRemoved> {
    let (disk, folder) = map.into().into_parts();
    let path = || MapPath::on(disk.clone(), &folder);
    let (selected, selection, seen) = {
        let reader = MapReader::open(path(), 1)?;
        reader.check_keeps_all()?;
        let selection = Selection::of(scans, &reader)?;
        (numbers(&reader, &selection)?, selection, reader.flush_number())
    };
    if selected.is_empty() {
        return Err(Error::argument("scans", format!("the map keeps none {}", selection.described)));
    }
    let fate = |record: &KeptRecord| if selection.has(record) { Fate::Goes } else { Fate::Stays };
    let mapped = rework(path(), seen, how, fate, progress)?;
    let mut removed =
        ScansRemoved { mapped, scans_removed: selected.len() as u64, ..ScansRemoved::default() };
    let store = TileStore::open_read_only(disk.clone(), &folder)?;
    for name in store.snapshot_names()? {
        if how.keep_as.as_ref() == Some(&name) || !holds_any(&store, &name, &selected)? {
            continue;
        }
        if from_snapshots && !how.is_dry_run {
            delete_snapshot(path(), &name)?;
            removed.snapshots_deleted.push(name);
        } else {
            removed.snapshots_with_them.push(name);
        }
    }
    if let Some(name) = &how.keep_as
        && !how.is_dry_run
    {
        removed.snapshots_with_them.push(name.clone());
    }
    Ok(removed)
}

/// A selection that needs no list of inputs any more.
struct Selection {
    kind: Kind,
    described: String,
}

enum Kind {
    Numbers(Vec<(u64, u64)>),
    Time(i64, i64),
}

impl Selection {
    fn of(scans: &ScanSelection, reader: &MapReader) -> Result<Self> {
        let (kind, described) = match scans {
            ScanSelection::Numbers(first, last) => {
                (Kind::Numbers(vec![(*first, *last)]), format!("with numbers from {first} to {last}"))
            }
            ScanSelection::Time(first, last) => {
                (Kind::Time(*first, *last), format!("from {first} to {last} ns"))
            }
            ScanSelection::Input(name) => {
                let inputs = reader.metadata().ext.as_ref().map_or(&[][..], |ext| &ext.inputs);
                let ranges = ranges_of(name, inputs, reader.scan_number());
                if ranges.is_empty() {
                    let names: Vec<_> = inputs.iter().map(|input| &*input.name).collect();
                    let reason = format!("the map has none of {name:?}; it has {}", names.join(", "));
                    return Err(Error::argument("input", reason));
                }
                (Kind::Numbers(ranges), format!("of input {name:?}"))
            }
        };
        Ok(Self { kind, described })
    }

    fn has(&self, record: &KeptRecord) -> bool {
        match &self.kind {
            Kind::Numbers(ranges) => {
                ranges.iter().any(|&(first, last)| (first..=last).contains(&record.number))
            }
            Kind::Time(first, last) => record.stamp_ns.is_some_and(|stamp| (*first..=*last).contains(&stamp)),
        }
    }
}

/// The numbers of the scans of an input, first and last; the map may have gone back to it later.
fn ranges_of(name: &str, inputs: &[InputRecord], scan_number: u64) -> Vec<(u64, u64)> {
    let ends = inputs.iter().skip(1).map(|next| next.first_scan).chain([scan_number]);
    let of_inputs = inputs.iter().zip(ends).filter(|(input, _)| input.name == name);
    of_inputs.map(|(input, end)| (input.first_scan + 1, end)).collect()
}

fn numbers(reader: &MapReader, selection: &Selection) -> Result<Vec<u64>> {
    let (mut records, mut numbers) = (reader.kept_records()?, Vec::new());
    while let Some(record) = records.next_kept()? {
        if selection.has(&record) {
            numbers.push(record.number);
        }
    }
    Ok(numbers)
}

/// Whether a snapshot keeps any of these scans.
fn holds_any(store: &TileStore, name: &SnapshotName, numbers: &[u64]) -> Result<bool> {
    let past = TileStore::open_snapshot(store.disk().clone(), store.folder(), name)?;
    if !past.keeps_scans() {
        return Ok(false);
    }
    let mut records = past.kept_records()?;
    while let Some(record) = records.next_kept()? {
        if numbers.binary_search(&record.number).is_ok() {
            return Ok(true);
        }
    }
    Ok(false)
}
