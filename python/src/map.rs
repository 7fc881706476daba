//! `voxtile.Map`: an open map.

use crate::arrays::{PointSlice, Points, column, doubles, object, rows};
use crate::config::{ConfigArguments, bytes_of, config_of};
use crate::distance::{DistanceField, options_of};
use crate::errors::{exception, exception_of_kind, wrong};
use crate::frontiers::{self, Frontier};
use crate::layers;
use crate::operations::named_snapshot;
use crate::questions::{self, bodies_of};
use crate::report::InsertReport;
use crate::scan::GivenScan;
use crate::scan_iterator::ScanIterator;
use crate::source::Source;
use crate::tile_iterator::TileIterator;
use crate::watched::{BETWEEN_LOOKS, at_once, briefly, finished, watched};
use numpy::{Element, PyArray1, PyArray2};
use parking_lot::RwLock;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Instant;
use voxtile::mapper::{MapReader, MapView, Mapper, OctreeMap};
use voxtile::sensor::Evidence;
use voxtile::{
    Aabb, MapConfig, MapOptions, MapQueries, OutOfCoreTileMapper, RayQuery, Result, ScanPoints, ScanRef,
    ScanReport, SnapshotName, Stop, TileIndex, UnknownAs,
};
use voxtile_distance::MapDistances;
use voxtile_pipeline::place::{check_is_folder, place_of};
use voxtile_render::Roof;

/// Up to this many queries, or points to insert, start on the calling thread and move to another one only if they take
/// long.
const FEW: usize = 128;

/// Upper bound on the number of scans that are passed to the mapper together.
const TOGETHER: usize = 32;

/// A batch with this many points takes no more scans: points of scans from a file use memory until they are inserted.
const POINTS_TOGETHER: usize = 1 << 20;

/// Occupancy map: each voxel is occupied, free or unknown.
///
/// Returned by `Map.create`, `Map.open` and `voxtile.open`; closed by `close` or at the end of a `with` block. Points
/// are arrays of N x 3 in metres, `float32` or `float64`; results are arrays in the order of the input. Several threads
/// may query the map while another inserts; each query sees complete scans.
#[pyclass(frozen, module = "voxtile")]
pub struct Map {
    /// `None` once the map is closed. Shared with the work that closes it, which may outlive the call.
    source: Arc<RwLock<Option<Arc<Source>>>>,
    config: MapConfig,
    path: PathBuf,
    /// Name of the snapshot, if the map is one.
    snapshot: Option<String>,
    /// Whether the last query took long. Long queries on the calling thread are stopped and repeated in a thread of
    /// their own, so the next queries start in such a thread.
    is_slow: AtomicBool,
}

type Found<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<i32>>);
type Nearest<'py> = (Bound<'py, PyArray2<i32>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);
type Occupied<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f32>>);

impl Map {
    fn opened(
        py: Python<'_>,
        path: PathBuf,
        open: impl FnOnce(&Path) -> Result<Source> + Send + 'static,
    ) -> PyResult<Self> {
        let at = path.clone();
        let source = finished(py, move |_| open(&at))?;
        let config = source.config();
        Ok(Self {
            source: Arc::new(RwLock::new(Some(Arc::new(source)))),
            config,
            path,
            snapshot: None,
            is_slow: AtomicBool::new(false),
        })
    }

    pub fn source(&self, py: Python<'_>) -> PyResult<Arc<Source>> {
        self.source.read().clone().ok_or_else(|| closed(py, &self.path))
    }

    /// Name of the map in messages.
    pub fn name(&self) -> PathBuf {
        self.snapshot.as_ref().map_or_else(|| self.path.clone(), |name| named_snapshot(&self.path, name))
    }

    /// Returns the map, if it is open for writing.
    fn writer(&self, py: Python<'_>) -> PyResult<Arc<Source>> {
        let source = self.source(py)?;
        if matches!(*source, Source::Writer { .. }) {
            return Ok(source);
        }
        let message =
            format!("{}: open for reading; open it with mode=\"r+\" to change it", self.path.display());
        Err(exception_of_kind(py, "read_only", &message))
    }

    /// Changes the map in a thread of its own so that Ctrl-C can interrupt it, or on this thread if the change is
    /// `short` and no other thread holds the map.
    fn change<T: Send>(
        &self,
        py: Python<'_>,
        short: bool,
        change: impl FnOnce(&mut OutOfCoreTileMapper) -> Result<T> + Send,
    ) -> PyResult<T> {
        let source = self.writer(py)?;
        let mut change = Some(change);
        if short && let Some(changed) = at_once(py, |stop| source.change_if_free(stop, &mut change))? {
            return Ok(changed);
        }
        let changed = change.map(|change| watched(py, |stop| source.change(stop, change))).transpose()?;
        changed.flatten().ok_or_else(|| closed(py, &self.path))
    }

    /// Inserts scans and returns one report of all.
    fn insert_together(&self, py: Python<'_>, given: &[GivenScan<'_>]) -> PyResult<InsertReport> {
        let scans = given.iter().map(|given| given.scan(py)).collect::<PyResult<Vec<ScanRef<'_>>>>()?;
        let scans: Vec<&dyn ScanPoints> = scans.iter().map(|scan| scan as _).collect();
        let is_short = scans.iter().map(|scan| scan.len()).sum::<usize>() <= FEW;
        let reports = self.change(py, is_short, |mapper| {
            let mut reports = Vec::with_capacity(scans.len());
            mapper.insert_all(&scans, &mut reports).map(|()| reports)
        })?;
        let mut all = InsertReport::from(ScanReport::default());
        reports.into_iter().for_each(|report| all.add(&report.into()));
        Ok(all)
    }

    /// Changes the map in a way that cannot be interrupted once it has begun.
    fn finish<T: Send + 'static>(
        &self,
        py: Python<'_>,
        change: impl FnOnce(&mut OutOfCoreTileMapper) -> Result<T> + Send + 'static,
    ) -> PyResult<T> {
        let source = self.writer(py)?;
        finished(py, move |stop| source.change(stop, change))?.ok_or_else(|| closed(py, &self.path))
    }

    /// Queries one value per point.
    fn at_points<'py, T: Element + Send>(
        &self,
        points: &Bound<'py, PyAny>,
        mut ask: impl FnMut(&Source, &Stop, PointSlice<'_>) -> Result<Vec<T>> + Send,
    ) -> PyResult<Bound<'py, PyArray1<T>>> {
        let py = points.py();
        let points = Points::of("points", points)?;
        let points = points.slice()?;
        let answers = self.ask(py, points.len(), |source, stop| ask(source, stop, points))?;
        Ok(column(py, answers))
    }

    /// Queries the map in a thread of its own, or on this thread if there are few queries and nothing to wait for.
    fn ask<T: Send>(
        &self,
        py: Python<'_>,
        questions: usize,
        mut ask: impl FnMut(&Source, &Stop) -> Result<T> + Send,
    ) -> PyResult<T> {
        let source = self.source(py)?;
        let mut work = |stop: &Stop| ask(&source, stop);
        let are_few = questions <= FEW;
        if are_few && source.is_free() && !self.is_slow.load(Relaxed) {
            if let Some(answer) = briefly(py, &mut work)? {
                return Ok(answer);
            }
            self.is_slow.store(true, Relaxed);
        }
        let begun = Instant::now();
        let answer = watched(py, work);
        if are_few && begun.elapsed() < BETWEEN_LOOKS / 2 {
            self.is_slow.store(false, Relaxed);
        }
        answer
    }
}

#[pymethods]
impl Map {
    /// Creates a map in a folder that is empty or does not exist.
    ///
    /// Lengths are in metres. `tile_size` is a whole number of voxels, by default the one nearest to 10. `memory` bounds all memory that grows with the map: bytes, or a text such as "512MiB"
    /// (the default). `insert_mode` is "per-scan" or "per-ray", `clearing` "octomap" or "guarded",
    /// `sensor_model` "log-odds" or "iwlo", `storage` "octomap" or "compact". `probabilities` of the log-odds model are
    /// those of a hit and a miss, then the minimum and the maximum. `layers` is what the map stores of the points that
    /// hit a voxel: "colour,intensity=255,class,time,shape" or a part of it, or a list of names.
    #[staticmethod]
    #[pyo3(signature = (path, resolution=0.1, *, tile_size=None, min_range=0.0, max_range=None, insert_mode="per-scan",
        clearing="octomap", sensor_model="log-odds", probabilities=None, occupancy_threshold=0.5, storage="octomap", memory=None, keep_scans=false,
        layers=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords, in Python")]
    fn create(
        py: Python<'_>,
        path: PathBuf,
        resolution: f64,
        tile_size: Option<f64>,
        min_range: f64,
        max_range: Option<f64>,
        insert_mode: &str,
        clearing: &str,
        sensor_model: &str,
        probabilities: Option<[f64; 4]>,
        occupancy_threshold: f64,
        storage: &str,
        memory: Option<Bound<'_, PyAny>>,
        keep_scans: bool,
        layers: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let config = config_of(
            py,
            &ConfigArguments {
                resolution,
                tile_size,
                min_range,
                max_range,
                insert_mode,
                clearing,
                sensor_model,
                probabilities,
                occupancy_threshold,
                storage,
                memory,
                keep_scans,
                layers,
            },
        )?;
        let options = MapOptions::new().config(config).create_new(true);
        Self::opened(py, path, move |path| Source::writer(options.open(path)?))
    }

    /// Opens a map to insert scans (mode "r+") or to query it (mode "r"). Readers may open a map that a writer has
    /// open.
    ///
    /// A `snapshot`, the URL of a map in a bucket and a file of OctoMap (`.bt`, `.ot`) are read-only. A file of OctoMap
    /// is loaded into memory.
    #[staticmethod]
    #[pyo3(signature = (path, mode="r+", *, snapshot=None, memory=None))]
    fn open(
        py: Python<'_>,
        path: PathBuf,
        mode: &str,
        snapshot: Option<&str>,
        memory: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let memory = memory.as_ref().map(bytes_of).transpose()?;
        let options = memory.map_or(MapOptions::new(), |bytes| MapOptions::new().memory_bytes(bytes));
        let name = snapshot.map(SnapshotName::new).transpose().map_err(|error| exception(py, &error))?;
        let is_octree = OctreeMap::is_named_by(&path);
        let reader = |reader: MapReader| Source::Reader(Box::new(RwLock::new(reader)));
        match (mode, name) {
            ("r", Some(name)) => {
                let snapshot = Some(name.to_string());
                let found = Self::opened(py, path, move |path| {
                    options.open_snapshot(place_of(path)?, &name).map(reader)
                })?;
                Ok(Self { snapshot, ..found })
            }
            ("r", None) if is_octree => Self::opened(py, path, Source::octree),
            ("r", None) => {
                Self::opened(py, path, move |path| options.open_read_only(place_of(path)?).map(reader))
            }
            ("r+", None) if !is_octree => Self::opened(py, path, move |path| {
                check_is_folder(path)?;
                Source::writer(options.open(path)?)
            }),
            ("r+", _) => {
                Err(wrong(py, "mode", "snapshots and files of OctoMap are read-only; use mode=\"r\""))
            }
            (other, _) => Err(wrong(py, "mode", format!("{other:?} is neither 'r+' nor 'r'"))),
        }
    }

    /// The map's folder, or the file of OctoMap.
    #[getter]
    fn path(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(py.import("pathlib")?.call_method1("Path", (&self.path,))?.unbind())
    }

    /// Edge of a voxel in metres.
    #[getter]
    fn resolution(&self) -> f64 {
        self.config.grid.resolution_m()
    }

    /// Edge of a tile in metres.
    #[getter]
    fn tile_size(&self) -> f64 {
        self.config.grid.tile_size_m()
    }

    /// Probability from which a voxel counts as occupied.
    #[getter]
    fn occupancy_threshold(&self) -> f64 {
        self.config.occupancy_threshold
    }

    /// Whether the map is closed.
    #[getter]
    fn closed(&self) -> bool {
        self.source.read().is_none()
    }

    /// Whether the map is open for writing.
    #[getter]
    fn writable(&self) -> bool {
        self.source.read().as_ref().is_some_and(|source| matches!(**source, Source::Writer { .. }))
    }

    /// Number of the last scan in the map; 0 for none.
    #[getter]
    fn scan_number(&self, py: Python<'_>) -> PyResult<u64> {
        self.ask(py, 1, |source, stop| source.ask(stop, |map| Ok(map.scan_number())))
    }

    /// Box around all observed space, in whole tiles: an array of 2 x 3, lower and upper corner in metres. `None` for
    /// an empty map.
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let tiles = self.tile_indices(py)?;
        let boxes = tiles.iter().map(|&tile| self.box_of(tile));
        let hull = boxes.reduce(|a, b| Aabb {
            min: std::array::from_fn(|k| a.min[k].min(b.min[k])),
            max: std::array::from_fn(|k| a.max[k].max(b.max[k])),
        });
        hull.map(|hull| rows(py, vec![hull.min, hull.max])).transpose()
    }

    /// Inserts a scan: rays from the sensor to its points.
    ///
    /// With `pose` (world_from_sensor: a matrix of 4 x 4, seven numbers x y z qx qy qz qw, or a tuple of position and
    /// quaternion) points are in the sensor's frame; with `origin` they are in the world's. Points that are NaN or
    /// masked are skipped and counted. `colours` (N x 3, 0 to 255) and `classes` (N, 0 to 255) are for the layers of
    /// the map; NaN, and a class below 0, mean that a point has none. After an error the map is unchanged.
    #[pyo3(signature = (points, pose=None, *, origin=None, intensities=None, colours=None, classes=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords, in Python")]
    fn insert<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        pose: Option<&Bound<'py, PyAny>>,
        origin: Option<&Bound<'py, PyAny>>,
        intensities: Option<&Bound<'py, PyAny>>,
        colours: Option<&Bound<'py, PyAny>>,
        classes: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<InsertReport> {
        let given = GivenScan::of(points, pose, origin, intensities)?.with_attributes(colours, classes)?;
        let scan = given.scan(py)?;
        let report = self.change(py, scan.len() <= FEW, |mapper| mapper.insert_points(&scan))?;
        Ok(report.into())
    }

    /// Inserts scans from an iterable of `(points, pose)` or `(points, pose, intensities)`. Returns one report of all.
    ///
    /// Scans of a list, of a tuple and of `voxtile.scans` are processed in parallel; the map is the same as with one
    /// `insert` per scan. After an error the scans before the failed one are in the map.
    fn insert_many<'py>(&self, py: Python<'py>, scans: &Bound<'py, PyAny>) -> PyResult<InsertReport> {
        // Other iterables may reuse the memory of a scan for the next one.
        let has_memory_of_its_own = scans.is_instance_of::<PyList>()
            || scans.is_instance_of::<PyTuple>()
            || scans.is_instance_of::<ScanIterator>();
        let most = if has_memory_of_its_own { TOGETHER } else { 1 };
        let mut all = InsertReport::from(ScanReport::default());
        let mut scans = scans.try_iter()?;
        let mut outcome = Ok(true);
        while matches!(outcome, Ok(true)) {
            let (mut given, mut points) = (Vec::new(), 0);
            while matches!(outcome, Ok(true)) && given.len() < most && points < POINTS_TOGETHER {
                outcome = scans.next().transpose().and_then(|scan| {
                    let Some(scan) = scan else { return Ok(false) };
                    let scan = GivenScan::of_tuple(&scan)?;
                    points += scan.scan(py)?.len();
                    given.push(scan);
                    Ok(true)
                });
            }
            // Inserts the scans before a wrong one.
            if !given.is_empty() {
                all.add(&self.insert_together(py, &given)?);
                py.check_signals()?;
            }
        }
        outcome.map(|_| all)
    }

    /// Writes all inserted scans to disk as one atomic flush. Does nothing for a map that is open for reading.
    ///
    /// With `wait=False` it returns at once and flushes the current state in the background while scans are inserted;
    /// `flushed_scan_number` reports the progress. An error of a background flush is raised by the next flush. If
    /// memory is short and very many small tiles wait to be written, the call waits anyway.
    #[pyo3(signature = (*, wait=true))]
    fn flush(&self, py: Python<'_>, wait: bool) -> PyResult<()> {
        if !matches!(*self.source(py)?, Source::Writer { .. }) {
            return Ok(());
        }
        self.finish(py, if wait { Mapper::flush } else { OutOfCoreTileMapper::begin_flush })
    }

    /// Number of the last scan that survives a crash.
    #[getter]
    fn flushed_scan_number(&self, py: Python<'_>) -> PyResult<u64> {
        match *self.source(py)? {
            Source::Writer { .. } => self.change(py, false, |mapper| Ok(mapper.flushed_scan_number())),
            Source::Reader(_) | Source::Octree(_) => self.scan_number(py),
        }
    }

    /// Flushes and closes the map. Closing a closed map does nothing.
    ///
    /// If the flush fails, the map stays open: free the disk and close the map again. `flush=False` discards all scans
    /// since the last flush.
    #[pyo3(signature = (*, flush=true))]
    fn close(&self, py: Python<'_>, flush: bool) -> PyResult<()> {
        let Some(source) = self.source.read().clone() else { return Ok(()) };
        let open = self.source.clone();
        finished(py, move |stop| {
            // Releases the lock on the map's files now. Queries of other threads may still run.
            source.close(stop, flush)?;
            drop((source, open.write().take()));
            Ok(())
        })
    }

    fn __enter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    #[pyo3(signature = (kind, error, traceback))]
    fn __exit__(
        &self,
        py: Python<'_>,
        kind: &Bound<'_, PyAny>,
        error: &Bound<'_, PyAny>,
        traceback: &Bound<'_, PyAny>,
    ) -> PyResult<bool> {
        let _ = (kind, error, traceback);
        self.close(py, true)?;
        Ok(false)
    }

    /// Loads the writer's latest flush into a map that is open for reading. Returns whether there was a new one.
    fn refresh(&self, py: Python<'_>) -> PyResult<bool> {
        self.ask(py, usize::MAX, |source, _| match source {
            Source::Reader(reader) => reader.write().refresh(),
            Source::Writer { .. } | Source::Octree(_) => Ok(false),
        })
    }

    /// Flushes, and keeps the current state of the map as a snapshot.
    fn snapshot(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        let name = SnapshotName::new(name).map_err(|error| exception(py, &error))?;
        self.finish(py, move |mapper| mapper.snapshot(&name))
    }

    /// Sizes of the map on disk and in memory, as a dict.
    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let statistics = self.ask(py, 1, |source, stop| source.ask(stop, |map| Ok(map.statistics())))?;
        object(py, &statistics)
    }

    /// Occupancy at points: an array of `int8`, 1 occupied, 0 free, -1 unknown.
    fn occupancy<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<i8>>> {
        let least = self.config.occupied_log_odds();
        let code = |of: Option<Evidence>| of.map_or(-1, |of| i8::from(of.log_odds >= least));
        self.at_points(points, |source, stop, points| questions::evidences(source, stop, points, code))
    }

    /// Probabilities of occupancy at points: `float64`, NaN for unknown.
    fn probability<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let probability = |of: Option<Evidence>| of.map_or(f64::NAN, |of| of.probability());
        self.at_points(points, |source, stop, points| questions::evidences(source, stop, points, probability))
    }

    /// Exact log-odds at points: `float64`, NaN for unknown.
    fn log_odds<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let log_odds = |of: Option<Evidence>| of.map_or(f64::NAN, |of| of.log_odds);
        self.at_points(points, |source, stop, points| questions::evidences(source, stop, points, log_odds))
    }

    /// Numbers of updates at points: `int32`, 0 for unknown.
    fn counts<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<i32>>> {
        let count = |of: Option<Evidence>| of.map_or(0, |of| of.observation_count);
        self.at_points(points, |source, stop, points| questions::evidences(source, stop, points, count))
    }

    /// First occupied voxel on each ray: distances in metres from the origin (infinite without a hit), and voxel
    /// indices, `int32` of N x 3 (the minimum of `int32` without a hit).
    ///
    /// `origins` is one point, or one per direction. `unknown` is "free" or "obstacle".
    #[pyo3(signature = (origins, directions, *, max_range=None, unknown="free"))]
    fn cast_rays<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        max_range: Option<f64>,
        unknown: &str,
    ) -> PyResult<Found<'py>> {
        let unknown = unknown_of(py, unknown)?;
        let directions = Points::of("directions", directions)?.slice()?.to_vec();
        let origins = match doubles("origins", origins)? {
            (shape, numbers) if shape == [3] => vec![[numbers[0], numbers[1], numbers[2]]; directions.len()],
            _ => Points::of("origins", origins)?.slice()?.to_vec(),
        };
        if origins.len() != directions.len() {
            let reason = format!("has {} points for {} directions", origins.len(), directions.len());
            return Err(wrong(py, "origins", reason));
        }
        let ray = |(origin, direction)| RayQuery { origin, direction, max_range_m: max_range, unknown };
        let rays: Vec<RayQuery> = origins.into_iter().zip(directions).map(ray).collect();
        let hits = self.ask(py, rays.len(), |source, stop| questions::rays(source, stop, &rays))?;
        let distances = hits.iter().map(|hit| hit.map_or(f64::INFINITY, |hit| hit.distance_m)).collect();
        let voxels = hits.iter().map(|hit| hit.map_or([i32::MIN; 3], |hit| hit.voxel)).collect();
        Ok((column(py, distances), rows(py, voxels)?))
    }

    /// Occupied voxel with the nearest center to each point, within `max_distance` metres: indices (`int32`, N x 3),
    /// distances (infinite if there is none), and directions to it (unit vectors; NaN if there is none or the point is
    /// the center).
    #[pyo3(signature = (points, max_distance=10.0))]
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        max_distance: f64,
    ) -> PyResult<Nearest<'py>> {
        let points = Points::of("points", points)?.slice()?.to_vec();
        let hits = self
            .ask(py, points.len(), |source, stop| questions::nearest(source, stop, &points, max_distance))?;
        let voxels = hits.iter().map(|hit| hit.map_or([i32::MIN; 3], |hit| hit.voxel)).collect();
        let distances = hits.iter().map(|hit| hit.map_or(f64::INFINITY, |hit| hit.distance_m)).collect();
        let towards = |(hit, point): (&Option<voxtile::Hit>, &voxtile::Point)| match hit {
            Some(hit) if hit.distance_m > 0.0 => {
                std::array::from_fn(|k| (hit.center_m[k] - point[k]) / hit.distance_m)
            }
            _ => [f64::NAN; 3],
        };
        let directions = hits.iter().zip(&points).map(towards).collect();
        Ok((rows(py, voxels)?, column(py, distances), rows(py, directions)?))
    }

    /// Whether boxes touch an occupied voxel: an array of `bool`. `boxes` are lower and upper corners in metres, N x 6
    /// or N x 2 x 3. `unknown` is "free" or "obstacle".
    #[pyo3(signature = (boxes, *, unknown="free"))]
    fn collides<'py>(
        &self,
        py: Python<'py>,
        boxes: &Bound<'py, PyAny>,
        unknown: &str,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let unknown = unknown_of(py, unknown)?;
        let bodies = bodies_of(boxes)?;
        // One box may be large, so even few boxes may take long.
        let answers =
            self.ask(py, usize::MAX, |source, stop| questions::collisions(source, stop, &bodies, unknown))?;
        Ok(column(py, answers))
    }

    /// Occupied voxels: centers in metres (`float64`, N x 3) and probabilities (`float32`), tile by tile.
    ///
    /// `region` is a box, lower and upper corner in metres. `min_probability` defaults to the map's threshold. Use
    /// `occupied_by_tile` for maps larger than memory.
    #[pyo3(signature = (region=None, min_probability=None))]
    fn occupied<'py>(
        &self,
        py: Python<'py>,
        region: Option<&Bound<'py, PyAny>>,
        min_probability: Option<f64>,
    ) -> PyResult<Occupied<'py>> {
        let region = region.map(region_of).transpose()?;
        let (centers, probabilities) = self.ask(py, usize::MAX, |source, stop| {
            source.ask(stop, |map| questions::occupied(map, region.as_ref(), min_probability))
        })?;
        Ok((rows(py, centers)?, column(py, probabilities)))
    }

    /// Iterates over the occupied voxels tile by tile, in constant memory. Yields the index of the tile, centers, and
    /// probabilities.
    #[pyo3(signature = (min_probability=None))]
    fn occupied_by_tile(&self, py: Python<'_>, min_probability: Option<f64>) -> PyResult<TileIterator> {
        let tiles = self.tile_indices(py)?;
        let boxes = tiles.into_iter().map(|tile| (tile, self.box_of(tile))).collect::<Vec<_>>().into_iter();
        Ok(TileIterator::new(self.source(py)?, self.path.clone(), boxes, min_probability))
    }

    /// Indices of the tiles with observed voxels: `int32`, N x 3.
    #[getter]
    fn tiles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i32>>> {
        rows(py, self.tile_indices(py)?.into_iter().map(|tile| [tile.x, tile.y, tile.z]).collect())
    }

    /// All voxels of a region as an array with axes x, y, z, and the lower corner of the first voxel in metres.
    ///
    /// `values` is "occupancy" (`int8`: 1 occupied, 0 free, -1 unknown), "probability" or "log_odds" (`float64`, NaN
    /// for unknown).
    #[pyo3(signature = (region, values="occupancy"))]
    fn to_dense<'py>(
        &self,
        py: Python<'py>,
        region: &Bound<'py, PyAny>,
        values: &str,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyArray1<f64>>)> {
        let region = region_of(region)?;
        let (voxels, array) = match values {
            "occupancy" => {
                let least = self.config.occupied_log_odds();
                let (voxels, values) = self.ask(py, usize::MAX, |source, stop| {
                    source.ask(stop, |map| {
                        questions::dense(map, &region, -1_i8, |evidence| i8::from(evidence.log_odds >= least))
                    })
                })?;
                (voxels, column(py, values).into_any())
            }
            "probability" | "log_odds" => {
                let is_probability = values == "probability";
                let (voxels, values) = self.ask(py, usize::MAX, |source, stop| {
                    source.ask(stop, |map| {
                        questions::dense(map, &region, f64::NAN, |evidence| {
                            if is_probability { evidence.probability() } else { evidence.log_odds }
                        })
                    })
                })?;
                (voxels, column(py, values).into_any())
            }
            other => {
                let reason = format!("{other:?} is not one of 'occupancy', 'probability', 'log_odds'");
                return Err(wrong(py, "values", reason));
            }
        };
        let edges: [i64; 3] =
            std::array::from_fn(|k| (i64::from(voxels.end[k]) - i64::from(voxels.min[k])).max(0));
        let corner = voxels.min.map(|index| self.config.grid.corner_m(index));
        Ok((array.call_method1("reshape", (edges,))?, column(py, corner.to_vec())))
    }

    /// Distances of the voxels of a region to the nearest obstacle, up to `max_distance`. Obstacles outside of the
    /// region count.
    ///
    /// `unknown` voxels have an unknown distance and shorten no other ("unknown"), or are "free" or an "obstacle".
    /// `signed` makes distances inside obstacles negative.
    #[pyo3(signature = (region, *, max_distance=5.0, unknown="unknown", signed=false))]
    fn distance_field(
        &self,
        py: Python<'_>,
        region: &Bound<'_, PyAny>,
        max_distance: f64,
        unknown: &str,
        signed: bool,
    ) -> PyResult<DistanceField> {
        let (region, options) = (region_of(region)?, options_of(py, max_distance, unknown, signed)?);
        let source = self.source(py)?;
        let field = finished(py, move |stop| source.ask(stop, |map| map.distance_field(&region, options)))?;
        Ok(DistanceField::new(field))
    }

    /// Frontiers: clusters of free voxels that share faces with unknown ones, where exploration can continue; the
    /// largest first.
    ///
    /// `region` is a box, lower and upper corner in metres: only voxels inside count, and the cost depends on the box,
    /// not on the map. Frontiers with less area than `min_area` in square metres, or fewer voxels than `min_voxels`,
    /// are left out.
    #[pyo3(signature = (region=None, *, min_area=0.0, min_voxels=8))]
    fn frontiers(
        &self,
        py: Python<'_>,
        region: Option<&Bound<'_, PyAny>>,
        min_area: f64,
        min_voxels: u64,
    ) -> PyResult<Vec<Frontier>> {
        let region = region.map(region_of).transpose()?;
        self.ask(py, usize::MAX, |source, stop| {
            source.ask(stop, |map| frontiers::found(map, region.as_ref(), min_area, min_voxels, stop))
        })
    }

    /// What the layers store of the points that hit the voxels at points: a dictionary of arrays. `points` is there in
    /// any case, the others with their layer: `colour` (N x 3), `intensity`, `intensity_deviation`, `class` (-1 for
    /// none), `first_ns`, `last_ns`, `mean_offset` from the voxel's center (N x 3, in metres), `covariance` (N x 6: xx,
    /// yy, zz, xy, xz, yz). NaN, and the lowest integer for times, mean that there is no value.
    fn layers_at<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
        let py = points.py();
        let points = Points::of("points", points)?;
        let points = points.slice()?;
        let found = self.ask(py, points.len(), |source, stop| layers::layers_at(source, stop, points))?;
        layers::arrays(py, &self.config, &found)
    }

    /// Names of the map's layers; empty without.
    #[getter]
    fn layers(&self) -> Vec<&'static str> {
        self.config.layers().names().collect()
    }

    /// Digest of the map's layers, as `voxtile digest --layers` prints it.
    fn layer_digest(&self, py: Python<'_>) -> PyResult<String> {
        let digest = self.ask(py, usize::MAX, |source, stop| source.ask(stop, |map| map.layer_digest()))?;
        Ok(digest.to_string())
    }

    /// Digest of the map's content, as the command prints it. Equal maps have equal digests.
    fn digest(&self, py: Python<'_>) -> PyResult<String> {
        let digest = self.ask(py, usize::MAX, |source, stop| source.ask(stop, |map| map.digest()))?;
        Ok(digest.to_string())
    }

    /// Height in metres at which pictures from above cut the ceiling: that of the sensor, if most columns around the
    /// trajectory are roofed; else None.
    #[pyo3(name = "_ceiling")]
    fn ceiling(&self, py: Python<'_>) -> PyResult<Option<f64>> {
        let source = self.source(py)?;
        watched(py, |stop| {
            let path = source.trajectory(&self.path)?;
            source.ask(stop, |view| Ok(Roof::of(view, &path)?.and_then(|roof| roof.cut_m())))
        })
    }

    /// Draws the map from above with matplotlib; see `voxtile.pictures.plot`.
    #[pyo3(signature = (**options))]
    fn plot(slf: &Bound<'_, Self>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Py<PyAny>> {
        let pictures = slf.py().import("voxtile.pictures")?;
        Ok(pictures.getattr("plot")?.call((slf,), options)?.unbind())
    }

    /// Opens the viewer in a browser and returns its process. The viewer shows the last flush.
    fn view(slf: &Bound<'_, Self>) -> PyResult<Py<PyAny>> {
        let (py, map) = (slf.py(), slf.get());
        map.source(py)?;
        Ok(py.import("voxtile.pictures")?.call_method1("view", (&map.path, &map.snapshot))?.unbind())
    }

    fn _repr_html_(slf: &Bound<'_, Self>) -> PyResult<String> {
        slf.py().import("voxtile.pictures")?.call_method1("summary_html", (slf,))?.extract()
    }

    fn __repr__(&self) -> String {
        let state = if self.closed() {
            "closed"
        } else if self.writable() {
            "r+"
        } else {
            "r"
        };
        format!("<voxtile.Map {} {} m, {state}>", self.path.display(), self.resolution())
    }

    /// Raises: a map cannot be pickled.
    fn __reduce__(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let message =
            "a map cannot be pickled; pass its path to the other process and open it there with mode=\"r\"";
        Err(exception_of_kind(py, "no_pickle", message))
    }
}

impl Map {
    fn tile_indices(&self, py: Python<'_>) -> PyResult<Vec<TileIndex>> {
        self.ask(py, 1, |source, stop| source.ask(stop, |map| Ok(map.tile_indices())))
    }

    /// Returns the box of a tile in metres.
    fn box_of(&self, tile: TileIndex) -> Aabb {
        let grid = &self.config.grid;
        let voxels = grid.voxels_of_tile(tile);
        Aabb { min: voxels.min.map(|k| grid.corner_m(k)), max: voxels.end.map(|k| grid.corner_m(k)) }
    }
}

/// Parses a box: lower and upper corner, six numbers or 2 x 3.
pub fn region_of(region: &Bound<'_, PyAny>) -> PyResult<Aabb> {
    let (shape, corners) = doubles("region", region)?;
    match (&shape[..], &corners[..]) {
        ([2, 3] | [6], &[x0, y0, z0, x1, y1, z1]) if x0 < x1 && y0 < y1 && z0 < z1 => {
            Ok(Aabb { min: [x0, y0, z0], max: [x1, y1, z1] })
        }
        _ => {
            let reason =
                format!("must be a lower and a higher corner, 2 x 3 numbers in metres, not {corners:?}");
            Err(wrong(region.py(), "region", reason))
        }
    }
}

fn unknown_of(py: Python<'_>, unknown: &str) -> PyResult<UnknownAs> {
    match unknown {
        "free" => Ok(UnknownAs::Free),
        "obstacle" => Ok(UnknownAs::Obstacle),
        other => Err(wrong(py, "unknown", format!("{other:?} is neither 'free' nor 'obstacle'"))),
    }
}

/// Returns the exception of a call on a closed map.
pub fn closed(py: Python<'_>, path: &Path) -> PyErr {
    exception_of_kind(py, "closed", &format!("{}: the map is closed; open it again", path.display()))
}
