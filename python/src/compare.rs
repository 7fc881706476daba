//! `voxtile.compare`: changes between two maps.

use crate::arrays::{Points, column, object, rows};
use crate::config::bytes_of;
use crate::errors::{exception_of_kind, wrong};
use crate::keywords::Keywords;
use crate::map::{Map, region_of};
use crate::operations::{Callback, MapOrSnapshot};
use crate::options::region;
use crate::source::{Source, State, View};
use crate::watched::{watched, watched_with_progress};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyBytes, PyDict};
use std::path::PathBuf;
use std::sync::Arc;
use voxtile::mapper::MapView;
use voxtile::store::Extension;
use voxtile::{Aabb, Error, Grid, MapConfig, Point, Result, Stop, TileBox};
use voxtile_compare::{
    CompareOptions, ComparedSpan, Viewpoints, VoxelClass, compare_span, count_blocks, for_each_voxel,
    join_spans,
};
use voxtile_pipeline::{ComparedMap, change_features, check_crs, class_code, warnings_of};

/// Memory for tiles.
const DEFAULT_BYTES: usize = 256 << 20;

type Voxels<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<u8>>);
/// Positions of the sensors of both maps: arrays of N x 3.
type PositionsOfBoth<'py> = (Option<Bound<'py, PyAny>>, Option<Bound<'py, PyAny>>);
/// Centers in metres and classes.
type Collected = (Vec<Point>, Vec<u8>);

/// An open map, or a place of one.
#[derive(FromPyObject)]
pub enum MapToCompare<'py> {
    /// An open map, with the scans that are not yet flushed.
    Open(Bound<'py, Map>),
    /// A place, perhaps of a file of OctoMap.
    At(MapOrSnapshot),
}

/// One of two compared maps.
struct Side {
    name: PathBuf,
    source: Arc<Source>,
    extension: Option<Extension>,
}

/// A side before it is opened.
enum Place {
    Open(Arc<Source>, PathBuf),
    At(MapOrSnapshot),
}

impl Place {
    fn of(py: Python<'_>, map: MapToCompare<'_>) -> PyResult<Self> {
        Ok(match map {
            MapToCompare::Open(map) => Self::Open(map.get().source(py)?, map.get().name()),
            MapToCompare::At(place) => Self::At(place),
        })
    }

    fn open(&self) -> Result<Side> {
        let (name, source) = match self {
            Self::Open(source, name) => (name.clone(), source.clone()),
            Self::At(place) => (place.name(), Arc::new(Source::at(place)?)),
        };
        let extension = source.extension(&name);
        Ok(Side { name, source, extension })
    }
}

/// Compares two maps: finds which occupied voxels of each are unchanged, changed, or not seen in the other one.
///
/// A map is an open `Map`, a path (also `"map@snapshot"`, and a file of OctoMap), or a tuple of a path and the name of
/// a snapshot. Both need the same resolution. `tolerance` in metres is the distance along each axis within which
/// occupied voxels are the same surface (default: one voxel). A voxel has changed if one map knows it as occupied and
/// the other as free, each with at least the probability `certainty`. Clusters of fewer than `min_voxels` voxels are
/// counted, not listed. `region` is a box, lower and upper corner in metres. `memory` is for tiles.
///
/// `positions` are those of the sensors of both maps, arrays of N x 3 in metres; default: those of kept scans, for maps
/// that are not open for writing. With them, voxels that the other map has not seen are hidden, if something is in front
/// of them wherever the sensor was, or out of view.
#[pyfunction]
#[pyo3(signature = (before, after, *, tolerance=None, certainty=0.7, min_voxels=8, region=None,
    positions=None, memory=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords, in Python")]
pub fn compare(
    py: Python<'_>,
    before: MapToCompare<'_>,
    after: MapToCompare<'_>,
    tolerance: Option<f64>,
    certainty: f64,
    min_voxels: u64,
    region: Option<Bound<'_, PyAny>>,
    positions: Option<PositionsOfBoth<'_>>,
    memory: Option<Bound<'_, PyAny>>,
    progress: Callback,
) -> PyResult<Comparison> {
    let options = CompareOptions::default()
        .with_tolerance(tolerance)
        .with_certainty(certainty)
        .with_min_voxels(min_voxels)
        .with_region(region.as_ref().map(region_of).transpose()?)
        .with_memory(memory.as_ref().map(bytes_of).transpose()?.unwrap_or(DEFAULT_BYTES));
    let places = [Place::of(py, before)?, Place::of(py, after)?];
    let asked = Asked { places, options, positions: positions_of(positions)? };
    watched_with_progress(py, progress, |stop, progress| {
        let report = |done, all| progress.report(done, all);
        asked
            .open(stop)?
            .compared(|before, after, options| voxtile_compare::compare(before, after, options, &report))
    })
}

/// Compares one of several parts of two maps, for `join_parts`: `part` counts from 0. `options` are keywords of
/// `compare`, without `progress`.
#[pyfunction]
pub fn compare_part<'py>(
    py: Python<'py>,
    before: MapOrSnapshot,
    after: MapOrSnapshot,
    part: u64,
    parts: u64,
    options: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyBytes>> {
    let asked = Asked::of(py, [before, after], options)?;
    let bytes = watched(py, |stop| {
        let opened = asked.open(stop)?;
        let maps = [&*opened.sides[0].source, &*opened.sides[1].source];
        let span = Source::ask_both(maps, stop, |[before, after], _| {
            check_crs(opened.compared_maps([before.config(), after.config()], [None; 2]))?;
            let all = u128::from(count_blocks(before, after, &opened.options)?);
            let border = |part: u64| (all * u128::from(part) / u128::from(parts.max(1))) as u64;
            compare_span(
                before,
                after,
                &opened.options,
                border(part)..border(part.saturating_add(1)),
                &|_, _| {},
            )
        })?;
        serde_json::to_vec(&span).map_err(|error| Error::argument("part", error.to_string()))
    })?;
    Ok(PyBytes::new(py, &bytes))
}

/// Joins the results of all parts of a comparison, in their order.
#[pyfunction]
pub fn join_parts<'py>(
    py: Python<'py>,
    before: MapOrSnapshot,
    after: MapOrSnapshot,
    parts: Vec<PyBackedBytes>,
    options: &Bound<'py, PyDict>,
) -> PyResult<Comparison> {
    let asked = Asked::of(py, [before, after], options)?;
    watched(py, |stop| {
        let span = |bytes: &PyBackedBytes| {
            serde_json::from_slice(bytes).map_err(|error| Error::argument("parts", error.to_string()))
        };
        asked.open(stop)?.compared(|before, after, options| {
            let spans: Vec<ComparedSpan> = parts.iter().map(span).collect::<Result<_>>()?;
            join_spans(before, after, options, spans)
        })
    })
}

/// Converts the positions of the sensors of both maps.
fn positions_of(positions: Option<PositionsOfBoth<'_>>) -> PyResult<[Option<Vec<Point>>; 2]> {
    let points_of = |points: &Bound<'_, PyAny>| -> PyResult<Vec<Point>> {
        Ok(Points::of("positions", points)?.slice()?.to_vec())
    };
    let (of_before, of_after) = positions.unwrap_or_default();
    let [of_before, of_after] =
        [of_before, of_after].map(|points| points.as_ref().map(points_of).transpose());
    Ok([of_before?, of_after?])
}

/// A comparison to be made.
struct Asked {
    places: [Place; 2],
    options: CompareOptions,
    positions: [Option<Vec<Point>>; 2],
}

/// A comparison with opened maps.
struct Opened {
    sides: [Side; 2],
    options: CompareOptions,
}

impl Asked {
    fn of(py: Python<'_>, places: [MapOrSnapshot; 2], options: &Bound<'_, PyDict>) -> PyResult<Self> {
        let positions = options.get_item("positions")?.filter(|positions| !positions.is_none());
        let positions = positions.map(|positions| positions.extract::<PositionsOfBoth<'_>>()).transpose()?;
        let keywords = options.copy()?;
        if keywords.contains("positions")? {
            keywords.del_item("positions")?;
        }
        let mut keywords = Keywords::of(&keywords)?;
        let mut options = CompareOptions::default()
            .with_tolerance(keywords.number("tolerance")?)
            .with_region(region(py, &mut keywords, "region")?)
            .with_memory(keywords.bytes("memory")?.unwrap_or(DEFAULT_BYTES));
        if let Some(certainty) = keywords.number("certainty")? {
            options = options.with_certainty(certainty);
        }
        if let Some(voxels) = keywords.count("min_voxels")? {
            options = options.with_min_voxels(voxels);
        }
        keywords.end()?;
        Ok(Self { places: places.map(Place::At), options, positions: positions_of(positions)? })
    }

    fn open(&self, stop: &Stop) -> Result<Opened> {
        let sides = [self.places[0].open()?, self.places[1].open()?];
        let viewpoints =
            [viewpoints(&sides[0], &self.positions[0])?, viewpoints(&sides[1], &self.positions[1])?];
        let options = self.options.clone().with_viewpoints(viewpoints).with_stop(stop.clone());
        Ok(Opened { sides, options })
    }
}

/// Returns the positions of a map's sensor: those given, or else those of its kept scans.
fn viewpoints(side: &Side, positions: &Option<Vec<Point>>) -> Result<Option<Viewpoints>> {
    match positions {
        None => Ok(side.source.viewpoints()),
        Some(positions) => {
            let range_m = side.source.config().rays.max_range_m;
            Viewpoints::new(positions.iter().copied(), range_m).map(Some)
        }
    }
}

/// Changes between two maps, returned by `voxtile.compare`.
///
/// Keeps maps that were given as paths open, as they were compared.
#[pyclass(frozen, module = "voxtile")]
pub struct Comparison {
    found: voxtile_compare::Comparison,
    options: CompareOptions,
    sides: [Side; 2],
    states: [State; 2],
    grid: Grid,
    crs: Option<String>,
    warnings: Vec<String>,
}

impl Opened {
    /// Both maps for checks of their frames and rules.
    fn compared_maps<'a>(
        &'a self,
        configs: [&'a MapConfig; 2],
        bounds: [Option<TileBox>; 2],
    ) -> [ComparedMap<'a>; 2] {
        [0, 1].map(|k| ComparedMap {
            path: &self.sides[k].name,
            config: configs[k],
            tile_bounds: bounds[k],
            extension: self.sides[k].extension.as_ref(),
        })
    }

    /// Compares with `compare`.
    fn compared(
        self,
        compare: impl Fn(&View<'_>, &View<'_>, &CompareOptions) -> Result<voxtile_compare::Comparison>,
    ) -> Result<Comparison> {
        let stop = self.options.stop.clone();
        let sources = [&*self.sides[0].source, &*self.sides[1].source];
        let (found, states, grid, crs, warnings) =
            Source::ask_both(sources, &stop, |[before, after], states| {
                let bounds = [before.tile_bounds(), after.tile_bounds()];
                let maps = self.compared_maps([before.config(), after.config()], bounds);
                let crs = check_crs(maps)?;
                let found = compare(before, after, &self.options)?;
                Ok((found, states, before.config().grid, crs, warnings_of(maps)))
            })?;
        let Self { sides, options } = self;
        Ok(Comparison { found, options, sides, states, grid, crs, warnings })
    }
}

impl Comparison {
    /// Returns the centers and classes of voxels; those of one change, or all. `None` if a map has changed.
    fn collect(&self, change: Option<u32>, stop: &Stop) -> Result<Option<Collected>> {
        let options = self.options.clone().with_stop(stop.clone());
        let classes: &[VoxelClass] = match change {
            Some(_) => &[VoxelClass::Vanished, VoxelClass::Appeared],
            None => &VoxelClass::ALL,
        };
        let sources = [&*self.sides[0].source, &*self.sides[1].source];
        Source::ask_both(sources, stop, |[before, after], states| {
            if states != self.states {
                return Ok(None);
            }
            let (mut centers_m, mut codes) = (Vec::new(), Vec::new());
            for_each_voxel(
                before,
                after,
                &options,
                &self.found,
                classes,
                |voxel| {
                    if change.is_none() || voxel.change == change {
                        centers_m.push(self.grid.center_m(voxel.index));
                        codes.push(class_code(voxel.class));
                    }
                    Ok(())
                },
                &|_, _| {},
            )?;
            Ok(Some((centers_m, codes)))
        })
    }
}

#[pymethods]
impl Comparison {
    /// Codes of the classes in arrays and files, by name.
    #[classattr]
    #[pyo3(name = "CLASSES")]
    fn classes(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let codes = PyDict::new(py);
        for class in VoxelClass::ALL {
            codes.set_item(class.name(), class_code(class))?;
        }
        Ok(codes)
    }

    /// Voxels of each class, by its name: a dict of "voxels", their number, and "volume_m3" in cubic metres. Unchanged
    /// voxels are those of the later map.
    #[getter]
    fn counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let counts = PyDict::new(py);
        for class in VoxelClass::ALL {
            let (of_class, voxels) = (PyDict::new(py), self.found.voxels_of(class));
            of_class.set_item("voxels", voxels)?;
            of_class.set_item("volume_m3", voxels as f64 * self.grid.resolution_m().powi(3))?;
            counts.set_item(class.name(), of_class)?;
        }
        Ok(counts)
    }

    /// The listed changes, the largest first.
    #[getter]
    fn changes(&self) -> Vec<Change> {
        self.found.changes.iter().cloned().map(Change).collect()
    }

    /// Reasons to doubt the result, the gravest first.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// Edge of a voxel in metres.
    #[getter]
    fn resolution(&self) -> f64 {
        self.grid.resolution_m()
    }

    /// Centers in metres (`float64`, N x 3) and classes (`uint8`, see `CLASSES`) of the occupied voxels of both maps,
    /// or of the change with a number. Reads the maps again; an open map must not have changed since.
    #[pyo3(signature = (change=None))]
    fn voxels<'py>(&self, py: Python<'py>, change: Option<u32>) -> PyResult<Voxels<'py>> {
        if let Some(number) = change
            && !self.found.changes.iter().any(|change| change.number == number)
        {
            let reason =
                format!("{number} is not the number of one of the {} changes", self.found.changes.len());
            return Err(wrong(py, "change", reason));
        }
        let Some((centers_m, codes)) = watched(py, |stop| self.collect(change, stop))? else {
            let message = "a map has changed since the comparison; compare the maps again";
            return Err(exception_of_kind(py, "changed", message));
        };
        Ok((rows(py, centers_m)?, column(py, codes)))
    }

    /// The result as a dict, as `voxtile compare --json` prints it.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let found = object(py, &self.found)?;
        found.set_item("resolution_m", self.grid.resolution_m())?;
        found.set_item("crs", self.crs.as_deref())?;
        found.set_item("warnings", &self.warnings)?;
        Ok(found)
    }

    /// The listed changes as GeoJSON, as a dict: a feature for each, with the rectangle around it in the coordinates of
    /// the maps, in metres.
    fn to_geojson<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        object(py, &change_features(&self.found.changes, self.crs.as_deref()))
    }

    fn _repr_html_(slf: &Bound<'_, Self>) -> PyResult<String> {
        slf.py().import("voxtile.pictures")?.call_method1("comparison_html", (slf,))?.extract()
    }

    fn __repr__(&self) -> String {
        let [vanished, appeared] =
            [VoxelClass::Vanished, VoxelClass::Appeared].map(|k| self.found.voxels_of(k));
        let changes = self.found.changes.len();
        format!("<voxtile.Comparison: {changes} changes; {vanished} voxels vanished, {appeared} appeared>")
    }
}

/// Cluster of voxels that vanished or appeared.
#[pyclass(frozen, module = "voxtile")]
pub struct Change(voxtile_compare::Change);

#[pymethods]
impl Change {
    /// Number, from 1 on: by the number of voxels, then by the lowest voxel.
    #[getter]
    fn number(&self) -> u32 {
        self.0.number
    }

    /// "vanished" or "appeared".
    #[getter]
    fn kind(&self) -> &'static str {
        self.0.kind.name()
    }

    /// Number of voxels.
    #[getter]
    fn voxels(&self) -> u64 {
        self.0.voxels
    }

    /// Volume of the voxels in cubic metres: of the surface that was seen.
    #[getter]
    fn volume_m3(&self) -> f64 {
        self.0.volume_m3
    }

    /// Lower and upper corner of the box around the voxels in metres, 2 x 3.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        corners(py, &self.0.bounds_m)
    }

    /// Mean of the centers in metres.
    #[getter]
    fn center<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        column(py, self.0.center_m.to_vec())
    }

    /// Mean colour of the points that hit it, red, green, blue from 0 to 255; `None` without this layer.
    #[getter]
    fn colour(&self) -> Option<(u8, u8, u8)> {
        self.0.colour.map(Into::into)
    }

    /// Class of most points that hit it; `None` without this layer.
    #[getter]
    fn class_(&self) -> Option<u8> {
        self.0.class
    }

    /// Time stamp of the first scan that hit it in nanoseconds; `None` without this layer.
    #[getter]
    fn first_ns(&self) -> Option<i64> {
        self.0.time_ns.map(|[first, _]| first)
    }

    /// Time stamp of the last scan that hit it in nanoseconds; `None` without this layer.
    #[getter]
    fn last_ns(&self) -> Option<i64> {
        self.0.time_ns.map(|[_, last]| last)
    }

    fn __repr__(&self) -> String {
        let ([x, y, z], change) = (self.0.center_m, &self.0);
        let (number, kind, voxels) = (change.number, change.kind.name(), change.voxels);
        format!("<voxtile.Change {number}: {voxels} voxels {kind} around {x:.2} {y:.2} {z:.2}>")
    }
}

/// Converts a box to an array of 2 x 3.
pub fn corners<'py>(py: Python<'py>, bounds_m: &Aabb) -> PyResult<Bound<'py, PyArray2<f64>>> {
    rows(py, vec![bounds_m.min, bounds_m.max])
}
