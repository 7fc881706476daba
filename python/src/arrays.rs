//! Conversion between numpy arrays and Rust slices.

use crate::errors::wrong;
use numpy::{Element, IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;
use voxtile::Point;

/// Points in the precision of the input array.
pub enum Points<'py> {
    /// Single precision.
    F32(PyReadonlyArray2<'py, f32>),
    /// Double precision.
    F64(PyReadonlyArray2<'py, f64>),
}

/// Points borrowed from an array.
#[derive(Clone, Copy)]
pub enum PointSlice<'a> {
    /// Single precision.
    F32(&'a [[f32; 3]]),
    /// Double precision.
    F64(&'a [Point]),
}

impl<'py> Points<'py> {
    /// Takes an array of N x 3. Borrows `float32` and `float64` in C order; copies any other array.
    pub fn of(argument: &str, points: &Bound<'py, PyAny>) -> PyResult<Self> {
        let (array, is_single) = numbers(argument, points, true)?;
        let shape: Vec<usize> = array.getattr("shape")?.extract()?;
        // An empty list has no columns to count.
        let array = match shape[..] {
            [_, 3] => array,
            [0] => array.call_method1("reshape", ((0, 3),))?,
            _ => {
                let reason = format!("must be an array of N x 3, not of the shape {shape:?}");
                return Err(wrong(points.py(), argument, reason));
            }
        };
        Ok(if is_single { Self::F32(array.extract()?) } else { Self::F64(array.extract()?) })
    }

    /// The points, without a copy.
    pub fn slice(&self) -> PyResult<PointSlice<'_>> {
        Ok(match self {
            Self::F32(array) => PointSlice::F32(array.as_slice()?.as_chunks().0),
            Self::F64(array) => PointSlice::F64(array.as_slice()?.as_chunks().0),
        })
    }
}

impl PointSlice<'_> {
    /// Number of points.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(points) => points.len(),
            Self::F64(points) => points.len(),
        }
    }

    /// Calls `take` with at most `most` points at a time, in double precision.
    pub fn in_chunks<E>(
        &self,
        most: usize,
        mut take: impl FnMut(&[Point]) -> Result<(), E>,
    ) -> Result<(), E> {
        match self {
            Self::F64(points) => points.chunks(most).try_for_each(take),
            Self::F32(points) => {
                let mut wide = Vec::new();
                points.chunks(most).try_for_each(|chunk| {
                    wide.clear();
                    wide.extend(chunk.iter().map(|point| point.map(f64::from)));
                    take(&wide)
                })
            }
        }
    }

    /// Returns a copy in double precision.
    pub fn to_vec(self) -> Vec<Point> {
        match self {
            Self::F32(points) => points.iter().map(|point| point.map(f64::from)).collect(),
            Self::F64(points) => points.to_vec(),
        }
    }
}

/// Takes an array of single-precision numbers, one per point.
pub fn singles<'py>(argument: &str, values: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArray1<'py, f32>> {
    let py = values.py();
    let (array, _) = numbers(argument, values, true)?;
    let array = required(&array, "float32")?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    match shape[..] {
        [_] => Ok(array.extract()?),
        _ => Err(wrong(py, argument, format!("must be a list of numbers, not of the shape {shape:?}"))),
    }
}

/// Returns the shape of an array and its numbers in C order, in double precision.
pub fn doubles(argument: &str, values: &Bound<'_, PyAny>) -> PyResult<(Vec<usize>, Vec<f64>)> {
    let (array, _) = numbers(argument, values, false)?;
    let shape = array.getattr("shape")?.extract()?;
    let flat: PyReadonlyArray1<'_, f64> = array.call_method1("reshape", (-1,))?.extract()?;
    Ok((shape, flat.as_slice()?.to_vec()))
}

/// Returns an aligned array in C order and native byte order, and whether it has single precision. Single precision is
/// kept if `may_be_single` is set. Masked elements become NaN.
fn numbers<'py>(
    argument: &str,
    values: &Bound<'py, PyAny>,
    may_be_single: bool,
) -> PyResult<(Bound<'py, PyAny>, bool)> {
    let py = values.py();
    let no_array = |error: PyErr| wrong(py, argument, format!("is not an array of numbers: {error}"));
    let numpy = numpy(py)?;
    let masked = numpy.getattr("ma")?.getattr("MaskedArray")?;
    let array = numpy.call_method1("asanyarray", (values,)).map_err(no_array)?;
    let array = if array.is_instance(&masked)? {
        let wide = array.getattr("dtype")?.getattr("kind")?.extract::<String>()? != "f";
        let array = if wide { array.call_method1("astype", ("float64",)).map_err(no_array)? } else { array };
        array.call_method1("filled", (f64::NAN,)).map_err(no_array)?
    } else {
        array
    };
    let dtype = array.getattr("dtype")?;
    let kind: String = dtype.getattr("kind")?.extract()?;
    if !["f", "i", "u"].contains(&kind.as_str()) {
        return Err(wrong(py, argument, format!("must be an array of numbers, not of {dtype}")));
    }
    let is_single = may_be_single && kind == "f" && dtype.getattr("itemsize")?.extract::<usize>()? == 4;
    let wanted = if is_single { "float32" } else { "float64" };
    Ok((required(&array, wanted).map_err(no_array)?, is_single))
}

fn required<'py>(array: &Bound<'py, PyAny>, dtype: &str) -> PyResult<Bound<'py, PyAny>> {
    numpy(array.py())?.call_method1("require", (array, dtype, ["C_CONTIGUOUS", "ALIGNED", "ENSUREARRAY"]))
}

/// Returns the module numpy.
pub fn numpy(py: Python<'_>) -> PyResult<&Bound<'_, PyAny>> {
    static NUMPY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    Ok(NUMPY.get_or_try_init(py, || PyResult::Ok(py.import("numpy")?.into_any().unbind()))?.bind(py))
}

/// Converts a list of rows to an array.
pub fn rows<T: Element, const N: usize>(
    py: Python<'_>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let count = rows.len();
    rows.into_flattened().into_pyarray(py).reshape([count, N])
}

/// Converts a list to an array.
pub fn column<T: Element>(py: Python<'_>, values: Vec<T>) -> Bound<'_, PyArray1<T>> {
    values.into_pyarray(py)
}

/// Converts a serializable value to Python objects.
pub fn object<'py>(py: Python<'py>, value: &impl serde::Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value)
        .map_err(|error| pyo3::exceptions::PyRuntimeError::new_err(error.to_string()))?;
    py.import("json")?.call_method("loads", (text,), None::<&Bound<'_, PyDict>>)
}
