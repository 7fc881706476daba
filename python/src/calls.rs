//! What the command does with files, in this process: the same options, checks and answers.

use crate::arrays::object;
use crate::errors::{exception_of_call, with_keywords};
use crate::operations::map_id_of;
use crate::watched::{Teller, left_to_itself};
use pyo3::prelude::*;
use serde_json::Value;
use std::ffi::OsString;
use std::sync::Arc;
use voxtile::Stop;
use voxtile_cli::{CallError, Listener, Watch, calls};

/// `voxtile build` with these arguments: a dict, what it prints with `--json`. With `piece_of`, 32 hexadecimal digits,
/// it makes a piece of the map with this id, which is not durable until `move_piece` has moved it.
#[pyfunction]
#[pyo3(signature = (arguments, progress=None, *, piece_of=None))]
pub fn call_build<'py>(
    py: Python<'py>,
    arguments: Vec<OsString>,
    progress: Option<Py<PyAny>>,
    piece_of: Option<&str>,
) -> PyResult<Bound<'py, PyAny>> {
    let piece_of = piece_of.map(|digits| map_id_of(py, "piece_of", digits)).transpose()?;
    called(py, progress, move |watch| match piece_of {
        None => calls::build(arguments, watch),
        Some(map_id) => calls::build_piece(arguments, map_id, watch),
    })
}

/// `voxtile export` with these arguments: a dict, what it prints with `--json`.
#[pyfunction]
#[pyo3(signature = (arguments, progress=None))]
pub fn call_export<'py>(
    py: Python<'py>,
    arguments: Vec<OsString>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    called(py, progress, move |watch| calls::export(arguments, watch))
}

/// Calls a command, which ends as after Ctrl-C where the callback raises.
fn called<'py>(
    py: Python<'py>,
    callback: Option<Py<PyAny>>,
    call: impl FnOnce(&Watch) -> Result<Value, CallError> + Send + 'static,
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
    let mut answer = outcome.map_err(|error| exception_of_call(py, &error))?;
    for remark in answer["remarks"].as_array_mut().into_iter().flatten() {
        *remark = with_keywords(remark.as_str().unwrap_or_default()).into();
    }
    object(py, &answer)
}
