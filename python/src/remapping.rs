//! Replays of the scans that a map keeps: new poses, other parameters, removals, marks of what moved.

use crate::config::{clearing_of, memory_of, storage_of};
use crate::errors::{exception_of_kind, wrong};
use crate::layers::layers_of;
use crate::map::region_of;
use crate::operations::{Callback, MapOrSnapshot, folder_of, name_of, reported};
use crate::pose::pose_of;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use voxtile::mapper::KeptSummary;
use voxtile::operations::{self, NewPoses, Remap, Replay, ScanSelection};
use voxtile::{Error, InsertMode, MapView, Result};
use voxtile_clean::Clean;
use voxtile_pipeline::interpolated_poses;

/// Returns the options common to all replays.
pub fn replay_of(
    py: Python<'_>,
    keep_as: Option<&str>,
    dry_run: bool,
    memory: Option<&Bound<'_, PyAny>>,
) -> PyResult<Replay> {
    let keep_as = keep_as.map(|name| name_of(py, name)).transpose()?;
    Ok(Replay::default().with_memory(memory_of(memory)?).with_keep_as(keep_as).with_dry_run(dry_run))
}

/// Assigns new poses to the scans that a map keeps, and replays the affected tiles. In one commit the map becomes as if
/// it had been built with these poses.
///
/// `poses` is one pose per scan in order (N x 4 x 4, N x 7, or a list of poses as `Map.insert` takes them), or a dict
/// of scan numbers and poses: other scans keep theirs, or with `interpolate` their motion relative to the two around
/// them in the dict. Scans that move and turn by at most `tolerance` (metres, degrees) keep their poses.
#[pyfunction]
#[pyo3(signature = (map, poses, *, tolerance=None, keep_as=None, dry_run=false, interpolate=false, memory=None,
    progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords, in Python")]
pub fn remap<'py>(
    py: Python<'py>,
    map: PathBuf,
    poses: &Bound<'py, PyAny>,
    tolerance: Option<(f64, f64)>,
    keep_as: Option<&str>,
    dry_run: bool,
    interpolate: bool,
    memory: Option<Bound<'py, PyAny>>,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let asked = Asked { map, poses: new_poses_of(poses)?, interpolate, tolerance };
    let how = replay_of(py, keep_as, dry_run, memory.as_ref())?;
    reported(py, progress, |stop, progress| {
        let (scans, poses, how) = asked.read(how.with_stop(stop.clone()))?;
        operations::remap(&scans, &poses, &how, |done, all| progress.report(done, all))
    })
}

/// Converts poses: a dict of scan numbers and poses, or one pose per scan in order.
pub fn new_poses_of(poses: &Bound<'_, PyAny>) -> PyResult<NewPoses> {
    Ok(match poses.cast::<PyDict>() {
        Ok(numbered) => {
            let poses = numbered.iter().map(|(number, pose)| Ok((number.extract()?, pose_of(&pose)?)));
            NewPoses::Numbered(poses.collect::<PyResult<_>>()?)
        }
        Err(_) => NewPoses::InOrder(poses.try_iter()?.map(|pose| pose_of(&pose?)).collect::<PyResult<_>>()?),
    })
}

/// New poses for a map.
pub struct Asked {
    pub map: PathBuf,
    pub poses: NewPoses,
    pub interpolate: bool,
    /// Metres and degrees.
    pub tolerance: Option<(f64, f64)>,
}

impl Asked {
    /// Reads the summary of the scans, and returns the poses of all that move.
    pub fn read(&self, replay: Replay) -> Result<(KeptSummary, NewPoses, Remap)> {
        let tolerance = self.tolerance.map(|(moved_m, turned_deg)| (moved_m, turned_deg.to_radians()));
        let scans = KeptSummary::read(folder_of(&self.map)?)?;
        let poses = match &self.poses {
            NewPoses::Numbered(some) if self.interpolate => interpolated_poses(&scans, some)?,
            _ if self.interpolate => {
                return Err(Error::argument("interpolate", "needs a dict of scan numbers and poses"));
            }
            poses => poses.clone(),
        };
        Ok((scans, poses, Remap::new(replay).with_tolerance(tolerance)))
    }
}

/// Makes a new map of the scans that a map keeps, with other parameters. Parameters that are not passed are those of
/// the map.
#[pyfunction]
#[pyo3(signature = (map, output, *, resolution=None, tile_size=None, min_range=None, max_range=None, insert_mode=None,
    clearing=None, layers=None, storage=None, keep_scans=false, memory=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords, in Python")]
pub fn remap_as<'py>(
    py: Python<'py>,
    map: MapOrSnapshot,
    output: PathBuf,
    resolution: Option<f64>,
    tile_size: Option<f64>,
    min_range: Option<f64>,
    max_range: Option<f64>,
    insert_mode: Option<&str>,
    clearing: Option<&str>,
    layers: Option<Bound<'py, PyAny>>,
    storage: Option<&str>,
    keep_scans: bool,
    memory: Option<Bound<'py, PyAny>>,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let insert_mode = match insert_mode {
        None => None,
        Some("per-scan") => Some(InsertMode::PerScan),
        Some("per-ray") => Some(InsertMode::PerRay),
        Some(other) => {
            return Err(wrong(py, "insert_mode", format!("{other:?} is neither 'per-scan' nor 'per-ray'")));
        }
    };
    let clearing = clearing.map(|clearing| clearing_of(py, clearing)).transpose()?;
    let layers = layers.as_ref().map(layers_of).transpose()?;
    let storage = storage.map(|storage| storage_of(py, storage)).transpose()?;
    let memory = memory_of(memory.as_ref())?;
    reported(py, progress, |stop, progress| {
        let reader = map.open()?;
        let own = reader.config().clone();
        let mut config = own.with_kept_scans(keep_scans);
        config.grid = config.grid.replaced(resolution, tile_size)?;
        config.storage = storage.unwrap_or(config.storage);
        config.memory = memory;
        config.layers = layers.or(config.layers);
        let rays = |rays: &voxtile::RayConfig| {
            let mut rays = *rays;
            rays.min_range_m = min_range.unwrap_or(rays.min_range_m);
            rays.max_range_m = max_range.or(rays.max_range_m);
            rays.insert_mode = insert_mode.unwrap_or(rays.insert_mode);
            rays.clearing = clearing.or(rays.clearing);
            rays
        };
        operations::rebuild(&reader, folder_of(&output)?, config, rays, stop, |done, all| {
            progress.report(done, all)
        })
    })
}

/// Removes scans from a map that keeps them, as if they had never been inserted. Selects them by `scans`, a first and a
/// last number; `time`, a first and a last time stamp in nanoseconds; or `input`, the name of the input that they were
/// read from.
///
/// Snapshots that contain any of them are listed in `snapshots_with_them`, or deleted with `from_snapshots` and listed
/// in `snapshots_deleted`. Raises `SnapshotsFailedError` if scans were removed, but a snapshot could not be read or
/// deleted and may still contain some; its `report` is the report.
#[pyfunction]
#[pyo3(signature = (map, *, scans=None, time=None, input=None, from_snapshots=false, keep_as=None, dry_run=false,
    memory=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords, in Python")]
pub fn remove_scans<'py>(
    py: Python<'py>,
    map: PathBuf,
    scans: Option<(u64, u64)>,
    time: Option<(i64, i64)>,
    input: Option<String>,
    from_snapshots: bool,
    keep_as: Option<&str>,
    dry_run: bool,
    memory: Option<Bound<'py, PyAny>>,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let selection = selection_of(py, scans, time, input)?;
    let how = replay_of(py, keep_as, dry_run, memory.as_ref())?;
    let report = reported(py, progress, |stop, progress| {
        let how = how.with_stop(stop.clone());
        operations::remove_scans(folder_of(&map)?, &selection, from_snapshots, &how, |done, all| {
            progress.report(done, all)
        })
    })?;
    removal_reported(py, &map, report)
}

/// Returns the scans to remove.
pub fn selection_of(
    py: Python<'_>,
    scans: Option<(u64, u64)>,
    time: Option<(i64, i64)>,
    input: Option<String>,
) -> PyResult<ScanSelection> {
    match (scans, time, input) {
        (Some((first, last)), None, None) => Ok(ScanSelection::Numbers(first, last)),
        (None, Some((first, last)), None) => Ok(ScanSelection::Time(first, last)),
        (None, None, Some(name)) => Ok(ScanSelection::Input(name)),
        _ => Err(wrong(py, "scans", "pass exactly one of scans, time and input")),
    }
}

/// Returns the report of a removal of scans, or raises `SnapshotsFailedError` with it.
pub fn removal_reported<'py>(
    py: Python<'py>,
    map: &Path,
    report: Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    let failed: Vec<Bound<'py, PyAny>> = report.get_item("snapshots_failed")?.extract()?;
    if failed.is_empty() {
        return Ok(report);
    }
    let names = failed.iter().map(|failed| failed.get_item("name")?.extract::<String>());
    let names = names.collect::<PyResult<Vec<_>>>()?.join(", ");
    let message = format!("{}: these snapshots may still contain removed scans: {names}", map.display());
    let raised = exception_of_kind(py, "snapshots_failed", &message);
    raised.value(py).setattr("report", report)?;
    Err(raised)
}

/// Removes all points in a box from the scans that a map keeps, and replays the voxels that their rays crossed.
#[pyfunction]
#[pyo3(signature = (map, region, *, keep_as=None, dry_run=false, memory=None, progress=None))]
pub fn remove_points<'py>(
    py: Python<'py>,
    map: PathBuf,
    region: &Bound<'py, PyAny>,
    keep_as: Option<&str>,
    dry_run: bool,
    memory: Option<Bound<'py, PyAny>>,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    let region = region_of(region)?;
    let how = replay_of(py, keep_as, dry_run, memory.as_ref())?;
    reported(py, progress, |stop, progress| {
        let how = how.with_stop(stop.clone());
        operations::remove_points(folder_of(&map)?, &region, &how, |done, all| progress.report(done, all))
    })
}

/// Marks the points of kept scans that hit something that moved, and rebuilds the map without these hits. Their rays
/// stay. Marks nothing outside of `region` (two corners in metres), and nothing that at least `parked_scans` scans hit
/// in the same place. With `undo`, removes all marks: the map is that of before.
#[pyfunction]
#[pyo3(signature = (map, *, undo=false, region=None, parked_scans=None, keep_as=None, dry_run=false, memory=None,
    progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords, in Python")]
pub fn clean<'py>(
    py: Python<'py>,
    map: PathBuf,
    undo: bool,
    region: Option<Bound<'py, PyAny>>,
    parked_scans: Option<u32>,
    keep_as: Option<&str>,
    dry_run: bool,
    memory: Option<Bound<'py, PyAny>>,
    progress: Callback,
) -> PyResult<Bound<'py, PyAny>> {
    if undo && (region.is_some() || parked_scans.is_some()) {
        return Err(wrong(py, "undo", "removes all marks; pass neither region nor parked_scans"));
    }
    if parked_scans == Some(0) {
        return Err(wrong(py, "parked_scans", "must be at least 1"));
    }
    let region = region.as_ref().map(region_of).transpose()?;
    let how = replay_of(py, keep_as, dry_run, memory.as_ref())?;
    reported(py, progress, |stop, progress| {
        let how = how.with_stop(stop.clone());
        let report = |_: voxtile_clean::Phase, done, all| progress.report(done, all);
        let options = Clean::new(how.clone()).with_region(region).with_parked_scans(parked_scans);
        match undo {
            true => voxtile_clean::undo(folder_of(&map)?, &how, report),
            false => voxtile_clean::clean(folder_of(&map)?, &options, report),
        }
    })
}
