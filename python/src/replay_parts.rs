//! Parts of a replay of kept scans, which several processes share; `voxtile.dask` uses them.

use crate::errors::{exception, wrong};
use crate::map::region_of;
use crate::operations::{folder_of, reported};
use crate::remapping::{Asked, new_poses_of, removal_reported, replay_of, selection_of};
use crate::watched::watched;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use voxtile::mapper::KeptSummary;
use voxtile::operations::{self, PointsInBox, Remap, Replay, ReplayPart, ScanChange, ScanSelection};
use voxtile::store::{FsDisk, UnsyncedDisk};
use voxtile::{Error, MapPath, Result, TileBox};
use voxtile_clean::{AllMarks, FoundMarks};

/// Change of kept scans as Python describes it: a dict with its kind and the arguments of the operation.
enum AskedChange {
    Move(Asked),
    Remove(ScanSelection),
    RemovePoints(PointsInBox),
    /// Files of found marks of moving points, and their texts.
    Mark(Vec<(PathBuf, FoundMarks)>),
    Unmark,
}

/// Change of the scans of one flush.
struct ReadChange {
    scans: KeptSummary,
    change: ScanChange,
    /// The found marks of a change that marks points.
    found: Option<AllMarks>,
}

impl AskedChange {
    fn of(py: Python<'_>, map: &Path, change: &Bound<'_, PyDict>) -> PyResult<Self> {
        let given = |name: &str| {
            let value = change.get_item(name)?;
            value.ok_or_else(|| PyKeyError::new_err(format!("change: {name} is missing")))
        };
        let kind: String = given("kind")?.extract()?;
        Ok(match &*kind {
            "move" => Self::Move(Asked {
                map: map.to_owned(),
                poses: new_poses_of(&given("poses")?)?,
                interpolate: given("interpolate")?.extract()?,
                tolerance: given("tolerance")?.extract()?,
            }),
            "remove_scans" => Self::Remove(selection_of(
                py,
                given("scans")?.extract()?,
                given("time")?.extract()?,
                given("input")?.extract()?,
            )?),
            "remove_points" => {
                let searches: Vec<String> = given("searches")?.extract()?;
                let searches = searches.iter().map(|text| read_text("searches", text));
                let searches = searches.collect::<Result<Vec<PointsInBox>>>();
                Self::RemovePoints(
                    searches.and_then(PointsInBox::joined).map_err(|error| exception(py, &error))?,
                )
            }
            "mark" => {
                let found: Vec<(PathBuf, String)> = given("found")?.extract()?;
                let found = found.into_iter().map(|(path, text)| Ok((path, read_text("found", &text)?)));
                Self::Mark(found.collect::<Result<_>>().map_err(|error| exception(py, &error))?)
            }
            "unmark" => Self::Unmark,
            other => return Err(wrong(py, "change", format!("{other:?} is no kind of change"))),
        })
    }

    fn read(self, map: &Path, replay: &Replay) -> Result<ReadChange> {
        let change = match self {
            Self::Move(asked) => {
                let (scans, poses, how) = asked.read(replay.clone())?;
                let change = ScanChange::Move(poses, how.tolerance);
                return Ok(ReadChange { scans, change, found: None });
            }
            Self::Remove(selection) => ScanChange::Remove(selection),
            Self::RemovePoints(found) => ScanChange::RemovePoints(found),
            Self::Mark(found) => {
                let scans = KeptSummary::read(folder_of(map)?)?;
                let found = AllMarks::of(&scans, map, &found)?;
                return Ok(ReadChange {
                    scans,
                    change: ScanChange::Mark(found.new_marks()),
                    found: Some(found),
                });
            }
            Self::Unmark => {
                let scans = KeptSummary::read(folder_of(map)?)?;
                let change = ScanChange::Mark(voxtile_clean::unmarked(&scans));
                return Ok(ReadChange { scans, change, found: None });
            }
        };
        Ok(ReadChange { scans: KeptSummary::read(folder_of(map)?)?, change, found: None })
    }
}

fn read_text<T: serde::de::DeserializeOwned>(argument: &'static str, text: &str) -> Result<T> {
    serde_json::from_str(text).map_err(|error| Error::argument(argument, error.to_string()))
}

fn written_text<T: serde::Serialize>(what: &T) -> Result<String> {
    serde_json::to_string(what).map_err(|error| Error::argument("part", error.to_string()))
}

/// Columns of tiles, by their index in units of `tiles`, that a change may affect: the parts of a replay that several
/// processes share. `change` is a dict: its `kind`, and the arguments of that function.
#[pyfunction]
pub fn replay_columns(
    py: Python<'_>,
    map: PathBuf,
    change: &Bound<'_, PyDict>,
    tiles: u32,
) -> PyResult<Vec<(i32, i32)>> {
    let change = AskedChange::of(py, &map, change)?;
    watched(py, |stop| {
        let how = Replay::default().with_stop(stop.clone());
        let ReadChange { scans, change, .. } = change.read(&map, &how)?;
        let columns = operations::replay_columns(&scans, &change, &how, tiles)?;
        Ok(columns.into_iter().map(Into::into).collect())
    })
}

/// Replays the tiles of a column as a shard, `output`, which is durable after `move_shard`. Returns a text for
/// `join_replay`. Without tiles to replay there is no shard.
#[pyfunction]
#[pyo3(signature = (map, change, column, tiles, output, *, memory=None))]
pub fn replay_part(
    py: Python<'_>,
    map: PathBuf,
    change: &Bound<'_, PyDict>,
    column: [i32; 2],
    tiles: u32,
    output: PathBuf,
    memory: Option<Bound<'_, PyAny>>,
) -> PyResult<String> {
    let change = AskedChange::of(py, &map, change)?;
    let replay = replay_of(py, None, false, memory.as_ref())?;
    watched(py, |stop| {
        let how = replay.with_stop(stop.clone());
        let ReadChange { scans, change, .. } = change.read(&map, &how)?;
        let disk = Arc::new(UnsyncedDisk::of(Arc::new(FsDisk)));
        let output = MapPath::on(disk, folder_of(&output)?);
        let region = TileBox::of_column(column, tiles);
        written_text(&operations::replay_part(&scans, &change, &how, region, output, |_, _| {})?)
    })
}

/// Applies a change with the parts of all columns: the shard of each, if there is one, and its text. One commit changes
/// the map. Returns the report of the operation.
#[expect(clippy::too_many_arguments, reason = "keywords, in Python")]
#[pyfunction]
#[pyo3(signature = (map, change, parts, *, keep_as=None, from_snapshots=false, memory=None, flush_number=None))]
pub fn join_replay<'py>(
    py: Python<'py>,
    map: PathBuf,
    change: &Bound<'py, PyDict>,
    parts: Vec<(Option<PathBuf>, String)>,
    keep_as: Option<&str>,
    from_snapshots: bool,
    memory: Option<Bound<'py, PyAny>>,
    flush_number: Option<u64>,
) -> PyResult<Bound<'py, PyAny>> {
    let change = AskedChange::of(py, &map, change)?;
    let replay = replay_of(py, keep_as, false, memory.as_ref())?;
    let is_removal = matches!(change, AskedChange::Remove(_));
    let read_part = |(shard, text): &(Option<PathBuf>, String)| {
        Ok((shard.as_ref().map(MapPath::from), read_text::<ReplayPart>("parts", text)?))
    };
    let report = reported(py, None, |stop, _| {
        let parts: Vec<_> = parts.iter().map(read_part).collect::<Result<_>>()?;
        let how = replay.with_stop(stop.clone()).with_parts(parts);
        let ReadChange { scans, change, found } = change.read(&map, &how)?;
        if flush_number.is_some_and(|begun_at| begun_at != scans.flush_number()) {
            return Err(Error::Changed { path: map.clone() });
        }
        let no_progress = |_, _| {};
        let report = match change {
            ScanChange::Move(poses, tolerance) => {
                let how = Remap::new(how).with_tolerance(tolerance);
                serde_json::to_value(operations::remap(&scans, &poses, &how, no_progress)?)
            }
            ScanChange::Remove(selection) => {
                let map = folder_of(&map)?;
                serde_json::to_value(operations::remove_scans(
                    map,
                    &selection,
                    from_snapshots,
                    &how,
                    no_progress,
                )?)
            }
            ScanChange::RemovePoints(found) => {
                serde_json::to_value(operations::remove_found_points(&scans, &found, &how, no_progress)?)
            }
            ScanChange::Mark(_) => serde_json::to_value(match &found {
                Some(found) => voxtile_clean::clean_found(&scans, found, &how)?,
                None => voxtile_clean::undo(folder_of(&map)?, &how, |_, _, _| {})?,
            }),
            _ => return Err(Error::argument("change", "cannot be joined")),
        };
        report.map_err(|error| Error::argument("report", error.to_string()))
    })?;
    if is_removal { removal_reported(py, &map, report) } else { Ok(report) }
}

/// Searches the kept scans from `first` to `last` for points in a box. Returns a text for `replay_columns`.
#[pyfunction]
pub fn search_points(
    py: Python<'_>,
    map: PathBuf,
    region: &Bound<'_, PyAny>,
    first: u64,
    last: u64,
) -> PyResult<String> {
    let region = region_of(region)?;
    watched(py, |stop| {
        let scans = KeptSummary::read(folder_of(&map)?)?;
        written_text(&PointsInBox::search(&scans, &region, first..=last, stop)?)
    })
}
