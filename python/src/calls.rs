//! What the commands `build` and `export` do, in this process: the same options, checks and answers.

use crate::arrays::object;
use crate::errors::exception_of_any;
use crate::keywords::Keywords;
use crate::operations::map_id_of;
use crate::options::{build_options, export_options};
use crate::watched::{Teller, left_to_itself};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::Value;
use std::path::PathBuf;
use std::sync::Arc;
use voxtile::{Error, Stop};
use voxtile_pipeline::{Listener, Watch, build, export, export_scans};

/// Builds a map: a dict, what `voxtile build` prints with `--json`. With `piece_of`, 32 hexadecimal digits, it makes a
/// piece of the map with this id, which is not durable until `move_piece` has moved it.
#[pyfunction]
#[pyo3(signature = (scans, output, options, progress=None, *, piece_of=None))]
pub fn call_build<'py>(
    py: Python<'py>,
    scans: PathBuf,
    output: PathBuf,
    options: &Bound<'py, PyDict>,
    progress: Option<Py<PyAny>>,
    piece_of: Option<&str>,
) -> PyResult<Bound<'py, PyAny>> {
    let mut options = build_options(py, &scans, output, Keywords::of(options)?)?;
    options.piece_of = piece_of.map(|digits| map_id_of(py, "piece_of", digits)).transpose()?;
    called(py, progress, move |watch| {
        let summary = build(&options, watch)?.ok_or(Error::Stopped)?;
        Ok(serde_json::to_value(summary)?)
    })
}

/// Writes a map for other programs: a dict, what `voxtile export` prints with `--json`.
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

/// Writes the scans that a map keeps into a new folder: a dict, what `voxtile export --scans` prints with `--json`.
#[pyfunction]
#[pyo3(signature = (map, folder, progress=None))]
pub fn call_export_scans<'py>(
    py: Python<'py>,
    map: PathBuf,
    folder: PathBuf,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    called(py, progress, move |watch| Ok(serde_json::to_value(export_scans(&map, &folder, watch)?)?))
}

/// Does something that ends as after Ctrl-C where the callback raises.
fn called<'py>(
    py: Python<'py>,
    callback: Option<Py<PyAny>>,
    call: impl FnOnce(&Watch) -> anyhow::Result<Value> + Send + 'static,
) -> PyResult<Bound<'py, PyAny>> {
    let stop = Stop::default();
    let teller = callback.map(|callback| Arc::new(Teller::new(stop.clone(), callback)));
    let listener =
        teller.clone().map(|teller| -> Listener { Arc::new(move |done, all| teller.tell(done, all)) });
    let watch = Watch::of_program(stop.clone(), listener);
    let outcome = left_to_itself(py, &stop, move || call(&watch))?;
    if let Some(raised) = teller.and_then(|teller| teller.raised()) {
        return Err(raised);
    }
    let answer = outcome.map_err(|error| exception_of_any(py, &error))?;
    object(py, &answer)
}
