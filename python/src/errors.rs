//! Conversion of voxtile's errors to the exceptions of `voxtile.errors`.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;
use voxtile::Error;

/// Returns the exception of an error, with path, tile and offset as attributes.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    with_details(py, Some(error), format!("{error:#}"))
}

/// Returns the exception of a failed build or export, with the same attributes.
pub fn exception_of_any(py: Python<'_>, error: &anyhow::Error) -> PyErr {
    with_details(py, error.downcast_ref(), format!("{error:#}"))
}

fn with_details(py: Python<'_>, error: Option<&Error>, message: String) -> PyErr {
    let tile = error.and_then(Error::tile).map(|tile| (tile.x, tile.y, tile.z));
    let (mut offset, mut line, mut record) = (None, None, None);
    match error.and_then(Error::place) {
        Some((voxtile::Place::Offset, at)) => offset = Some(at),
        Some((voxtile::Place::Line, at)) => line = Some(at),
        Some((voxtile::Place::Record, at)) => record = Some(at),
        None => {}
    }
    let details = PyDict::new(py);
    let filled = details
        .set_item("path", error.and_then(Error::path))
        .and_then(|()| details.set_item("tile", tile))
        .and_then(|()| details.set_item("offset", offset))
        .and_then(|()| details.set_item("line", line))
        .and_then(|()| details.set_item("record", record));
    filled
        .and_then(|()| raised(py, error.map_or("other", Error::kind), message, &details))
        .unwrap_or_else(|error| error)
}

/// Returns the exception of a kind that exists only in Python: `closed`, `read_only`.
pub fn exception_of_kind(py: Python<'_>, kind: &str, message: &str) -> PyErr {
    raised(py, kind, message.to_owned(), &PyDict::new(py)).unwrap_or_else(|error| error)
}

/// Returns the exception of a wrong argument.
pub fn wrong(py: Python<'_>, argument: &str, reason: impl Into<String>) -> PyErr {
    exception(py, &Error::argument(argument, reason))
}

fn raised(py: Python<'_>, kind: &str, message: String, details: &Bound<'_, PyDict>) -> PyResult<PyErr> {
    static MAKE: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let make =
        MAKE.get_or_try_init(py, || py.import("voxtile.errors")?.getattr("of_kind").map(Bound::unbind))?;
    Ok(PyErr::from_value(make.bind(py).call((kind, message), Some(details))?))
}
