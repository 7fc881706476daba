//! voxtile's errors as exceptions: one class for each remedy, in `voxtile.errors`.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;
use voxtile::Error;

/// The exception of an error, with path, tile and offset as attributes.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let tile = error.tile().map(|tile| (tile.x, tile.y, tile.z));
    let (mut offset, mut line) = (None, None);
    match error.place() {
        Some((voxtile::Place::Line, at)) => line = Some(at),
        Some((_, at)) => offset = Some(at),
        None => {}
    }
    let details = PyDict::new(py);
    let filled = details
        .set_item("path", error.path())
        .and_then(|()| details.set_item("tile", tile))
        .and_then(|()| details.set_item("offset", offset))
        .and_then(|()| details.set_item("line", line));
    filled
        .and_then(|()| raised(py, error.kind(), format!("{error:#}"), &details))
        .unwrap_or_else(|error| error)
}

/// The exception of a kind that only Python knows: `closed`, `read_only`.
pub fn exception_of_kind(py: Python<'_>, kind: &str, message: &str) -> PyErr {
    raised(py, kind, message.to_owned(), &PyDict::new(py)).unwrap_or_else(|error| error)
}

/// A wrong argument.
pub fn wrong(py: Python<'_>, argument: &str, reason: impl Into<String>) -> PyErr {
    exception(py, &Error::argument(argument, reason))
}

fn raised(py: Python<'_>, kind: &str, message: String, details: &Bound<'_, PyDict>) -> PyResult<PyErr> {
    static MAKE: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let make =
        MAKE.get_or_try_init(py, || py.import("voxtile.errors")?.getattr("of_kind").map(Bound::unbind))?;
    Ok(PyErr::from_value(make.bind(py).call((kind, message), Some(details))?))
}
