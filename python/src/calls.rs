//! The commands `build` and `export` in this process: the same options, checks and reports.

use crate::arrays::object;
use crate::errors::exception_of_any;
use crate::keywords::Keywords;
use crate::operations::map_id_of;
use crate::options::{Paths, build_options, export_options};
use crate::watched::{Reporter, run_detached};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::Value;
use std::path::PathBuf;
use std::sync::Arc;
use voxtile::{Error, Stop};
use voxtile_pipeline::{Listener, Watch, WhichPoints, build, export, export_scans};

/// Builds a map. Returns the report that `voxtile build` prints with `--json`, as a dict. With `shard_of`, 32
/// hexadecimal digits, it builds a shard of the map with this id; the shard is not durable until `move_shard` has moved
/// it. `scans_before` is the number of scans of that map, if the shard is part of an update.
#[pyfunction]
#[pyo3(signature = (scans, output, options, progress=None, *, shard_of=None, scans_before=0))]
pub fn call_build<'py>(
    py: Python<'py>,
    scans: Paths,
    output: PathBuf,
    options: &Bound<'py, PyDict>,
    progress: Option<Py<PyAny>>,
    shard_of: Option<&str>,
    scans_before: u64,
) -> PyResult<Bound<'py, PyAny>> {
    let mut options = build_options(py, scans, output, Keywords::of(options)?)?;
    options.piece_of = shard_of.map(|digits| map_id_of(py, "shard_of", digits)).transpose()?;
    options.scans_before = scans_before;
    called(py, progress, move |watch| {
        let summary = build(&options, watch)?.ok_or(Error::Stopped)?;
        Ok(serde_json::to_value(summary)?)
    })
}

/// Exports a map. Returns the report that `voxtile export` prints with `--json`, as a dict.
#[pyfunction]
#[pyo3(signature = (map, output, options, progress=None))]
pub fn call_export<'py>(
    py: Python<'py>,
    map: PathBuf,
    output: PathBuf,
    options: &Bound<'py, PyDict>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let options = export_options(py, map, &output, Keywords::of(options)?)?;
    called(py, progress, move |watch| Ok(serde_json::to_value(export(&options, watch)?)?))
}

/// Exports the scans that a map keeps into a new folder. Returns the report that `voxtile export --scans` prints with
/// `--json`, as a dict.
#[pyfunction]
#[pyo3(signature = (map, folder, only_moving=false, progress=None))]
pub fn call_export_scans<'py>(
    py: Python<'py>,
    map: PathBuf,
    folder: PathBuf,
    only_moving: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let which = if only_moving { WhichPoints::Moving } else { WhichPoints::All };
    called(py, progress, move |watch| Ok(serde_json::to_value(export_scans(&map, &folder, which, watch)?)?))
}

/// Runs `work`. If the callback raises, the work stops as after Ctrl-C.
fn called<'py>(
    py: Python<'py>,
    callback: Option<Py<PyAny>>,
    call: impl FnOnce(&Watch) -> anyhow::Result<Value> + Send + 'static,
) -> PyResult<Bound<'py, PyAny>> {
    let stop = Stop::default();
    let reporter = callback.map(|callback| Arc::new(Reporter::new(stop.clone(), callback)));
    let listener = reporter
        .clone()
        .map(|reporter| -> Listener { Arc::new(move |done, all| reporter.report(done, all)) });
    let watch = Watch::of_program(stop.clone(), listener);
    let outcome = run_detached(py, &stop, move || call(&watch))?;
    if let Some(raised) = reporter.and_then(|reporter| reporter.raised()) {
        return Err(raised);
    }
    let answer = outcome.map_err(|error| exception_of_any(py, &error))?;
    object(py, &answer)
}
