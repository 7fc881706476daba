//! `voxtile.TileIterator`: the occupied voxels of a map that may be larger than memory.

use crate::arrays::{column, rows};
use crate::map::closed;
use crate::questions;
use crate::source::Source;
use crate::watched::at_once;
use numpy::{PyArray1, PyArray2};
use parking_lot::Mutex;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;
use voxtile::{Aabb, TileIndex};

/// Iterates over the occupied voxels of a map, tile by tile: `(tile, centers, probabilities)`.
#[pyclass(frozen, module = "voxtile")]
pub struct TileIterator {
    source: Arc<Source>,
    path: PathBuf,
    tiles: Mutex<std::vec::IntoIter<(TileIndex, Aabb)>>,
    min_probability: Option<f64>,
}

impl TileIterator {
    /// Iterates over tiles with their boxes in metres, in this order.
    pub fn new(
        source: Arc<Source>,
        path: PathBuf,
        tiles: std::vec::IntoIter<(TileIndex, Aabb)>,
        min_probability: Option<f64>,
    ) -> Self {
        Self { source, path, tiles: Mutex::new(tiles), min_probability }
    }
}

type OccupiedOfTile<'py> = ((i32, i32, i32), Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f32>>);

#[pymethods]
impl TileIterator {
    fn __iter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<OccupiedOfTile<'py>>> {
        let Some((tile, region)) = self.tiles.lock().next() else { return Ok(None) };
        if let Source::Writer { mapper, .. } = &*self.source
            && mapper.try_lock().is_some_and(|mapper| mapper.is_none())
        {
            return Err(closed(py, &self.path));
        }
        let (centers, probabilities) = at_once(py, |stop| {
            self.source.ask(stop, |map| questions::occupied(map, Some(&region), self.min_probability))
        })?;
        Ok(Some(((tile.x, tile.y, tile.z), rows(py, centers)?, column(py, probabilities))))
    }
}
