//! `voxtile.ScanIterator`: the scans of a file or folder, by the command's own readers, and those that a map keeps.

use crate::arrays::{column, rows};
use crate::errors::{exception, exception_of_call};
use crate::pose::matrix_of;
use crate::watched::left_to_itself;
use numpy::{PyArray1, PyArray2};
use parking_lot::Mutex;
use pyo3::prelude::*;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use voxtile::mapper::{KeptScan, KeptScans, MapReader};
use voxtile::scan::ScanPoints;
use voxtile::{Pose, Result as Fallible, Stop};
use voxtile_cli::{CallError, calls};
use voxtile_formats::{ScanReach, ScanSource, SensorScan};

/// A scan that was read: points in the sensor's frame, and its pose.
type ReadScan<'py> =
    (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Option<Bound<'py, PyArray1<f32>>>);

/// Iterates over scans: `(points, pose, intensities)`, what `Map.insert_many` takes.
#[pyclass(frozen, module = "voxtile")]
pub struct ScanIterator {
    reading: Arc<Mutex<Reading>>,
    /// As far as it is known.
    left: AtomicUsize,
}

struct Reading {
    scans: Scans,
    /// What was read for somebody who was interrupted meanwhile.
    read: Option<Fallible<Option<SensorScan>>>,
}

/// Where scans come from.
enum Scans {
    Input(Box<dyn ScanSource + Send>),
    /// A map that keeps them, and how many.
    Kept(Box<KeptScans>, usize),
}

impl Scans {
    fn next(&mut self) -> Fallible<Option<SensorScan>> {
        match self {
            Self::Input(scans) => scans.next_scan(),
            Self::Kept(scans, _) => scans.next().map(|scan| in_memory(&scan?)).transpose(),
        }
    }
}

/// A kept scan with all its points. Points in the world frame get a pose at the sensor's place.
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
    Ok(SensorScan { name: scan.number().to_string(), points_in_sensor, intensities, world_from_sensor })
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
            left_to_itself(py, &Stop::default(), read)?;
            // Another thread may have taken it.
            if let Some(read) = self.reading.try_lock().and_then(|mut reading| reading.read.take()) {
                break read;
            }
        };
        let Some(scan) = read.map_err(|error| exception(py, &error))? else {
            self.left.store(0, Ordering::Relaxed);
            return Ok(None);
        };
        // Nobody waits for it, so that a step too few is no harm.
        self.left.store(self.left.load(Ordering::Relaxed).saturating_sub(1), Ordering::Relaxed);
        let SensorScan { points_in_sensor, intensities, world_from_sensor, .. } = scan;
        let pose = rows(py, matrix_of(&world_from_sensor))?;
        Ok(Some((rows(py, points_in_sensor)?, pose, intensities.map(|intensities| column(py, intensities)))))
    }

    /// Number of scans to come, if it is known before they are read; else 0.
    fn __length_hint__(&self) -> usize {
        self.left.load(Ordering::Relaxed)
    }
}

/// The scans of a path, read with these arguments of `voxtile build`.
#[pyfunction]
pub fn open_scans(py: Python<'_>, path: PathBuf, arguments: Vec<OsString>) -> PyResult<ScanIterator> {
    let opened = left_to_itself(py, &Stop::default(), move || open(&path, arguments))?;
    let scans = opened.map_err(|error| exception_of_call(py, &error))?;
    let count = match &scans {
        Scans::Input(scans) => scans.len_hint(),
        Scans::Kept(_, count) => Some(*count),
    };
    Ok(ScanIterator {
        reading: Arc::new(Mutex::new(Reading { scans, read: None })),
        left: AtomicUsize::new(count.unwrap_or(0)),
    })
}

fn open(path: &Path, arguments: Vec<OsString>) -> Result<Scans, CallError> {
    if !(arguments.is_empty() && is_map(path)) {
        return Ok(Scans::Input(calls::open_scans(path, arguments)?));
    }
    let reader = MapReader::open(path, 1)?;
    let (mut records, mut count) = (reader.kept_scans()?, 0);
    while records.next_record()?.is_some() {
        count += 1;
    }
    Ok(Scans::Kept(Box::new(reader.kept_scans()?), count))
}

/// Content and bounds of a scan: west, south, east, north.
type Reach = (String, Option<(f64, f64, f64, f64)>);

/// Reads the scans of a path, and tells of each what tells it from others, 32 hexadecimal digits, and a box around it
/// and its rays along x and y in metres, `None` if it leaves nothing.
#[pyfunction]
#[pyo3(signature = (path, arguments, *, max_range=None, no_return_range=None))]
pub fn scan_reaches(
    py: Python<'_>,
    path: PathBuf,
    arguments: Vec<OsString>,
    max_range: Option<f64>,
    no_return_range: Option<f64>,
) -> PyResult<Vec<Reach>> {
    let stop = Stop::default();
    let asked = stop.clone();
    let reaches = left_to_itself(py, &stop, move || -> Result<Vec<Reach>, CallError> {
        let (mut scans, mut reaches) = (open(&path, arguments)?, Vec::new());
        while let Some(scan) = scans.next()? {
            asked.check()?;
            let ScanReach { content, bounds } = ScanReach::of(&scan, max_range, no_return_range);
            let content = content.iter().map(|byte| format!("{byte:02x}")).collect();
            reaches.push((content, bounds.map(|[low, high]| (low[0], low[1], high[0], high[1]))));
        }
        Ok(reaches)
    })?;
    reaches.map_err(|error| exception_of_call(py, &error))
}

/// The number of scans of a path; where only reading tells it, they are read.
#[pyfunction]
pub fn count_scans(py: Python<'_>, path: PathBuf, arguments: Vec<OsString>) -> PyResult<usize> {
    let counted = left_to_itself(py, &Stop::default(), move || -> Result<usize, CallError> {
        let mut scans = calls::open_scans(&path, arguments)?;
        match scans.len_hint() {
            Some(count) => Ok(count),
            None => Ok(scans.skip(usize::MAX)?),
        }
    })?;
    counted.map_err(|error| exception_of_call(py, &error))
}

fn is_map(path: &Path) -> bool {
    path.join("metadata.json").is_file() && path.join("commits.log").is_file()
}
