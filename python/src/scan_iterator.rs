//! `voxtile.ScanIterator`: the scans of a file or folder, or those that a map keeps.

use crate::arrays::{column, rows};
use crate::errors::{exception, exception_of_any};
use crate::keywords::Keywords;
use crate::options::{Paths, read_options};
use crate::pose::matrix_of;
use crate::watched::run_detached;
use numpy::{PyArray1, PyArray2};
use parking_lot::Mutex;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use voxtile::mapper::{KeptScan, KeptScans, MapReader};
use voxtile::scan::{MovingMarks, PointAttributes, ScanPoints};
use voxtile::{Pose, Result as Fallible, Stop};
use voxtile_formats::{ReadOptions, ScanReach, ScanSource, SensorScan};
use voxtile_pipeline::Watch;
use voxtile_pipeline::place::{is_map_at, place_of, url_of};

/// A scan: points in the sensor's frame, the pose, and intensities.
type ReadScan<'py> =
    (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Option<Bound<'py, PyArray1<f32>>>);

/// Iterates over scans: `(points, pose, intensities)`, as `Map.insert_many` takes them. `moving` has the marks of the
/// last one.
#[pyclass(frozen, module = "voxtile")]
pub struct ScanIterator {
    reading: Arc<Mutex<Reading>>,
    /// Number of scans left, if known.
    left: AtomicUsize,
    /// Marks of the scan returned last.
    moving: Mutex<Option<MovingMarks>>,
}

struct Reading {
    scans: Scans,
    /// Scan that was read for a call that Ctrl-C interrupted.
    read: Option<Fallible<Option<MarkedScan>>>,
}

/// A scan, and its marks of moving points if it has any.
type MarkedScan = (SensorScan, Option<MovingMarks>);

/// Source of the scans.
enum Scans {
    Input(Box<dyn ScanSource + Send>),
    /// A map that keeps its scans, and their number.
    Kept(Box<KeptScans>, usize),
}

impl Scans {
    fn next(&mut self) -> Fallible<Option<MarkedScan>> {
        match self {
            Self::Input(scans) => Ok(scans.next_scan()?.map(|scan| (scan, None))),
            Self::Kept(scans, _) => {
                let Some(scan) = scans.next().transpose()? else { return Ok(None) };
                Ok(Some((in_memory(&scan)?, scan.moving().cloned())))
            }
        }
    }
}

/// Reads a kept scan with all its points. Points in the world frame get a pose at the sensor's position.
fn in_memory(scan: &KeptScan) -> Fallible<SensorScan> {
    let origin = scan.origin();
    let pose = scan.world_from_sensor();
    let (mut points_in_sensor, mut intensities) = (Vec::new(), scan.has_intensities().then(Vec::new));
    scan.for_each_own_chunk(0..scan.len(), &mut |points, of_points| {
        match pose {
            Some(_) => points_in_sensor.extend_from_slice(points),
            None => points_in_sensor.extend(
                points.iter().map(|point| std::array::from_fn::<f64, 3, _>(|k| point[k] - origin[k])),
            ),
        }
        if let Some(all) = &mut intensities {
            all.extend_from_slice(of_points.unwrap_or_default());
        }
        true
    })?;
    let world_from_sensor = match pose {
        Some(pose) => pose,
        None => Pose::from_quaternion(origin, [0.0, 0.0, 0.0, 1.0])?,
    };
    let (name, attributes) = (scan.number().to_string(), PointAttributes::default());
    Ok(SensorScan { name, points_in_sensor, intensities, attributes, world_from_sensor })
}

#[pymethods]
impl ScanIterator {
    fn __iter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __next__<'py>(&self, py: Python<'py>) -> PyResult<Option<ReadScan<'py>>> {
        let read = loop {
            let reading = self.reading.clone();
            let read = move || {
                let mut reading = reading.lock();
                if reading.read.is_none() {
                    reading.read = Some(reading.scans.next());
                }
            };
            run_detached(py, &Stop::default(), read)?;
            // Another thread may have taken it.
            if let Some(read) = self.reading.try_lock().and_then(|mut reading| reading.read.take()) {
                break read;
            }
        };
        let Some((scan, moving)) = read.map_err(|error| exception(py, &error))? else {
            self.left.store(0, Ordering::Relaxed);
            return Ok(None);
        };
        // A race between threads makes the hint wrong by one, which is harmless.
        self.left.store(self.left.load(Ordering::Relaxed).saturating_sub(1), Ordering::Relaxed);
        *self.moving.lock() = moving;
        let SensorScan { points_in_sensor, intensities, world_from_sensor, .. } = scan;
        let pose = rows(py, matrix_of(&world_from_sensor))?;
        Ok(Some((rows(py, points_in_sensor)?, pose, intensities.map(|intensities| column(py, intensities)))))
    }

    /// Whether each point of the scan returned last is marked as moving (see `voxtile.clean`); `None` if none is.
    #[getter]
    fn moving<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<bool>>> {
        self.moving.lock().as_ref().map(|marks| column(py, marks.iter().collect::<Vec<_>>()))
    }

    /// Number of scans left, if it is known without reading them; else 0.
    fn __length_hint__(&self) -> usize {
        self.left.load(Ordering::Relaxed)
    }
}

/// Paths and the options to read them.
struct Input {
    paths: Vec<PathBuf>,
    options: ReadOptions,
    /// Whether any option was passed.
    has_options: bool,
}

impl Input {
    fn of(py: Python<'_>, paths: Paths, options: &Bound<'_, PyDict>) -> PyResult<Self> {
        let mut keywords = Keywords::of(options)?;
        let read = read_options(py, &mut keywords)?;
        keywords.end()?;
        Ok(Self { paths: paths.without_stream(), options: read, has_options: !options.is_empty() })
    }

    fn open(&self) -> anyhow::Result<Scans> {
        let [path] = &self.paths[..] else { return Ok(Scans::Input(self.source()?)) };
        if self.has_options || !is_map(path)? {
            return Ok(Scans::Input(self.source()?));
        }
        let reader = MapReader::open(place_of(path)?, 0)?;
        let count = reader.kept_summary()?.scans().len();
        Ok(Scans::Kept(Box::new(reader.kept_scans()?), count))
    }

    fn source(&self) -> anyhow::Result<Box<dyn ScanSource + Send>> {
        Ok(voxtile_pipeline::open_paths(&self.paths, &self.options, &Watch::silent())?)
    }
}

/// Opens the scans of a path, or of several.
#[pyfunction]
pub fn open_scans(py: Python<'_>, path: Paths, options: &Bound<'_, PyDict>) -> PyResult<ScanIterator> {
    let input = Input::of(py, path, options)?;
    let opened = run_detached(py, &Stop::default(), move || input.open())?;
    let scans = opened.map_err(|error| exception_of_any(py, &error))?;
    let count = match &scans {
        Scans::Input(scans) => scans.len_hint(),
        Scans::Kept(_, count) => Some(*count),
    };
    Ok(ScanIterator {
        reading: Arc::new(Mutex::new(Reading { scans, read: None })),
        left: AtomicUsize::new(count.unwrap_or(0)),
        moving: Mutex::new(None),
    })
}

/// Fingerprint and bounds of a scan: west, south, east, north.
type Reach = (String, Option<(f64, f64, f64, f64)>);

/// Reads the scans of a path. Returns for each a fingerprint of 32 hexadecimal digits, and a box around it and its rays
/// along x and y in metres, `None` if it changes no voxel.
#[pyfunction]
#[pyo3(signature = (path, options, *, max_range=None, no_return_range=None))]
pub fn scan_reaches(
    py: Python<'_>,
    path: Paths,
    options: &Bound<'_, PyDict>,
    max_range: Option<f64>,
    no_return_range: Option<f64>,
) -> PyResult<Vec<Reach>> {
    let input = Input::of(py, path, options)?;
    let stop = Stop::default();
    let asked = stop.clone();
    let reaches = run_detached(py, &stop, move || -> anyhow::Result<Vec<Reach>> {
        let (mut scans, mut reaches) = (input.open()?, Vec::new());
        while let Some((scan, _)) = scans.next()? {
            asked.check()?;
            let ScanReach { content, bounds } = ScanReach::of(&scan, max_range, no_return_range);
            let content = content.iter().map(|byte| format!("{byte:02x}")).collect();
            reaches.push((content, bounds.map(|[low, high]| (low[0], low[1], high[0], high[1]))));
        }
        Ok(reaches)
    })?;
    reaches.map_err(|error| exception_of_any(py, &error))
}

/// Returns the number of scans of a path. Reads them if the format does not store their number.
#[pyfunction]
pub fn count_scans(py: Python<'_>, path: Paths, options: &Bound<'_, PyDict>) -> PyResult<usize> {
    let input = Input::of(py, path, options)?;
    let counted = run_detached(py, &Stop::default(), move || -> anyhow::Result<usize> {
        let mut scans = input.source()?;
        match scans.len_hint() {
            Some(count) => Ok(count),
            None => Ok(scans.skip(usize::MAX)?),
        }
    })?;
    counted.map_err(|error| exception_of_any(py, &error))
}

fn is_map(path: &Path) -> Fallible<bool> {
    match url_of(path) {
        Some(url) => is_map_at(url, &Stop::default()),
        None => Ok(path.join("metadata.json").is_file() && path.join("commits.log").is_file()),
    }
}
