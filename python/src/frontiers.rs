//! `voxtile.Frontier`: where exploration can continue.

use crate::arrays::column;
use crate::compare::corners;
use crate::source::View;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use voxtile::mapper::MapView;
use voxtile::{Aabb, Result, Stop};
use voxtile_compare::{FrontierOptions, frontiers_in};

/// Returns the frontiers in a box, or in the whole map, with at least an area in square metres.
pub fn found(
    map: &View<'_>,
    region: Option<&Aabb>,
    min_area_m2: f64,
    min_voxels: u64,
    stop: &Stop,
) -> Result<Vec<Frontier>> {
    let grid = map.config().grid;
    let whole = map.tile_bounds().map(|tiles| {
        let voxels = grid.voxels_of_tiles(tiles);
        Aabb { min: voxels.min.map(|k| grid.corner_m(k)), max: voxels.end.map(|k| grid.corner_m(k)) }
    });
    let Some(region) = region.or(whole.as_ref()) else { return Ok(Vec::new()) };
    let options = FrontierOptions::default().with_min_voxels(min_voxels).with_stop(stop.clone());
    let frontiers = frontiers_in(map, region, &options)?.into_iter();
    Ok(frontiers.filter(|frontier| frontier.area_m2 >= min_area_m2).map(Frontier).collect())
}

/// Cluster of free voxels that share faces with unknown ones, returned by `Map.frontiers`.
#[pyclass(frozen, module = "voxtile")]
pub struct Frontier(voxtile_compare::Frontier);

#[pymethods]
impl Frontier {
    /// Number, from 1 on: by the number of voxels, then by the lowest voxel.
    #[getter]
    fn number(&self) -> u32 {
        self.0.number
    }

    /// Number of voxels.
    #[getter]
    fn voxels(&self) -> u64 {
        self.0.voxels
    }

    /// Area of the faces between its voxels and unknown ones, in square metres.
    #[getter]
    fn area_m2(&self) -> f64 {
        self.0.area_m2
    }

    /// Lower and upper corner of the box around its voxels in metres, 2 x 3.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        corners(py, &self.0.bounds_m)
    }

    /// Mean of the centers in metres. Its place may be occupied or unknown.
    #[getter]
    fn center<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        column(py, self.0.center_m.to_vec())
    }

    /// Center in metres of its voxel nearest to the mean: free space next to the unknown, a goal for a robot.
    #[getter]
    fn goal<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        column(py, self.0.goal_m.to_vec())
    }

    fn __repr__(&self) -> String {
        let ([x, y, z], area_m2) = (self.0.center_m, self.0.area_m2);
        format!("<voxtile.Frontier {}: {area_m2:.2} m2 around {x:.2} {y:.2} {z:.2}>", self.0.number)
    }
}
