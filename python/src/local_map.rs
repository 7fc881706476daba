//! `voxtile.LocalMap`: obstacles around the robot, inflated for a planner.

use crate::arrays::{Points, column, object, rows};
use crate::errors::{exception, wrong};
use crate::questions::bodies_of;
use crate::scan::Frame;
use crate::watched::{at_once, watched};
use numpy::{PyArray1, PyArray2};
use parking_lot::Mutex;
use pyo3::prelude::*;
use voxtile::{Point, Queries, Result, Stop, UnknownAs};
use voxtile_local::{LocalParameters, LocalReader, LocalState, Obstacle};

/// Up to this many points are inserted without a thread of their own: Ctrl-C need not interrupt them.
const FEW: usize = 1 << 14;

/// Local map in memory: occupied voxels around the robot, and voxels too close to them.
///
/// `preset` is "local-mapping" (the latest 50,000 voxels within 40 m, inflated within 8 m), "autonomous-mapping" (all
/// voxels, inflated within 8 m) or "passive-perception" (points at any distance, all inflated). Lengths are in metres.
/// Several threads may query the map while another inserts; each query sees complete updates.
#[pyclass(frozen, module = "voxtile")]
pub struct LocalMap {
    map: Mutex<voxtile_local::LocalMap>,
    reader: LocalReader,
}

#[pymethods]
impl LocalMap {
    #[new]
    #[pyo3(signature = (resolution=0.1, *, preset="local-mapping", max_voxels=None, min_range=None, max_range=None, inflation_range=None, inflation_radius=None))]
    #[expect(clippy::too_many_arguments, reason = "they have names in Python")]
    fn new(
        py: Python<'_>,
        resolution: f64,
        preset: &str,
        max_voxels: Option<usize>,
        min_range: Option<f64>,
        max_range: Option<f64>,
        inflation_range: Option<f64>,
        inflation_radius: Option<f64>,
    ) -> PyResult<Self> {
        let mut parameters = match preset {
            "local-mapping" => LocalParameters::local_mapping(),
            "autonomous-mapping" => LocalParameters::autonomous_mapping(),
            "passive-perception" => LocalParameters::passive_perception(),
            _ => {
                let known = "local-mapping, autonomous-mapping or passive-perception";
                return Err(wrong(py, "preset", format!("must be {known}, not `{preset}`")));
            }
        };
        parameters.max_voxels = max_voxels.or(parameters.max_voxels);
        for (place, given) in [
            (&mut parameters.min_input_range_m, min_range),
            (&mut parameters.input_range_m, max_range),
            (&mut parameters.inflation_range_m, inflation_range),
            (&mut parameters.inflation_radius_m, inflation_radius),
        ] {
            *place = given.unwrap_or(*place);
        }
        let map =
            voxtile_local::LocalMap::new(resolution, parameters).map_err(|error| exception(py, &error))?;
        Ok(Self { reader: map.reader(), map: Mutex::new(map) })
    }

    /// Inserts a scan, as `Map.insert` does. Returns counts of the update as a dict.
    #[pyo3(signature = (points, pose=None, *, origin=None))]
    fn insert<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        pose: Option<&Bound<'py, PyAny>>,
        origin: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let points = Points::of("points", points)?;
        let scan = Frame::of(py, pose, origin)?.scan(points.slice()?);
        let report = at_once(py, |_| self.map.lock().insert_points(&scan))?;
        object(py, &report)
    }

    /// States at points (`int8`): 2 for occupied voxels, 1 for inflated ones, 0 for all others, free or unknown.
    fn state<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<i8>>> {
        let points = Points::of("points", points)?;
        let slice = points.slice()?;
        let view = self.reader.view();
        let code = |point: &Point| match view.state_at(*point) {
            LocalState::None => 0,
            LocalState::Inflated => 1,
            LocalState::Occupied => 2,
        };
        let ask = |stop: &Stop| {
            let mut states = Vec::with_capacity(slice.len());
            slice.in_chunks(FEW, |chunk| {
                stop.check()?;
                states.extend(chunk.iter().map(code));
                Ok::<(), voxtile::Error>(())
            })?;
            Ok(states)
        };
        let states = if slice.len() <= FEW { at_once(py, ask)? } else { watched(py, ask)? };
        Ok(column(py, states))
    }

    /// Centers of the occupied voxels: N x 3.
    fn occupied<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.centers(py, LocalState::Occupied)
    }

    /// Centers of the voxels that are inflated and not occupied: N x 3.
    fn inflated<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.centers(py, LocalState::Inflated)
    }

    /// Whether boxes (N x 6 or N x 2 x 3: lower and upper corner) touch an occupied voxel or, with `inflated`, an
    /// inflated one: an array of `bool`.
    #[pyo3(signature = (boxes, *, inflated=true))]
    fn collides<'py>(
        &self,
        py: Python<'py>,
        boxes: &Bound<'py, PyAny>,
        inflated: bool,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let bodies = bodies_of(boxes)?;
        let view = self.reader.view();
        let answers: Vec<bool> = watched(py, |stop| {
            let obstacles = view.obstacles(obstacle(inflated));
            let ask = |body| {
                stop.check()?;
                Ok(obstacles.collision(body, UnknownAs::Free)?.is_some())
            };
            bodies.iter().map(ask).collect::<Result<_>>()
        })?;
        Ok(column(py, answers))
    }

    /// Position of the sensor at the last update; `None` before the first.
    #[getter]
    fn position(&self) -> Option<Point> {
        self.reader.view().position()
    }

    /// Edge of a voxel in metres.
    #[getter]
    fn resolution(&self) -> f64 {
        self.reader.view().resolution_m()
    }

    /// Number of updates so far.
    #[getter]
    fn updates(&self) -> u64 {
        self.reader.view().update_number()
    }

    fn __repr__(&self) -> String {
        let view = self.reader.view();
        let (occupied, inflated) = (view.occupied_voxels(), view.inflated_voxels());
        format!("<voxtile.LocalMap of {} m: {occupied} occupied, {inflated} inflated>", view.resolution_m())
    }
}

impl LocalMap {
    fn centers<'py>(&self, py: Python<'py>, wanted: LocalState) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let view = self.reader.view();
        let centers = py.detach(|| {
            let grid = view.resolution_m();
            let mut centers = Vec::new();
            view.for_each(|voxel, state| {
                if state == wanted {
                    centers.push(voxel.map(|k| (f64::from(k) + 0.5) * grid));
                }
            });
            centers
        });
        rows(py, centers)
    }
}

fn obstacle(inflated: bool) -> Obstacle {
    if inflated { Obstacle::Inflated } else { Obstacle::Occupied }
}
