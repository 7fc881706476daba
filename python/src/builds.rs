//! Files of scans, by the command's own readers: iterated over, or made a map of.

use crate::arrays::{column, rows};
use crate::config::{ConfigArguments, config_of};
use crate::pose::matrix_of;
use crate::report::InsertReport;
use crate::watched::{watched, watched_with_progress};
use numpy::{PyArray1, PyArray2};
use parking_lot::Mutex;
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use voxtile::io::{PointRoom, ReadOptions, RecordingOptions, ScanSource, SensorScan, open_any_scans};
use voxtile::mapper::{KeptScan, KeptScans, MapReader, Mapper};
use voxtile::scan::ScanPoints;
use voxtile::{Error, OutOfCoreTileMapper, Pose, Result, ScanReport};

/// What a crash may take from a build.
const BETWEEN_FLUSHES: Duration = Duration::from_secs(60);
/// Most bytes of a scan in memory; the rest is in a file meanwhile.
const MOST_SCAN_BYTES: usize = 64 << 20;

/// A scan that was read: points in the sensor's frame, and its pose.
type ReadScan<'py> =
    (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Option<Bound<'py, PyArray1<f32>>>);

/// Iterates over scans: `(points, pose, intensities)`, what `Map.insert_many` takes.
#[pyclass(frozen, module = "voxtile")]
pub struct ScanIterator {
    scans: Mutex<Scans>,
}

/// Where scans come from.
enum Scans {
    Input(Box<dyn ScanSource + Send>),
    /// A map that keeps them, and how many are left.
    Kept(Box<KeptScans>, usize),
}

impl Scans {
    fn next(&mut self) -> Result<Option<SensorScan>> {
        match self {
            Self::Input(scans) => scans.next_scan(),
            Self::Kept(scans, left) => {
                *left = left.saturating_sub(1);
                scans.next().map(|scan| in_memory(&scan?)).transpose()
            }
        }
    }
}

/// A kept scan with all its points. Points in the world frame get a pose at the sensor's place.
fn in_memory(scan: &KeptScan) -> Result<SensorScan> {
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
        let Some(scan) = watched(py, |_| self.scans.lock().next())? else { return Ok(None) };
        let SensorScan { points_in_sensor, intensities, world_from_sensor, .. } = scan;
        let pose = rows(py, matrix_of(&world_from_sensor))?;
        Ok(Some((rows(py, points_in_sensor)?, pose, intensities.map(|intensities| column(py, intensities)))))
    }

    /// Number of scans, if it is known before they are read.
    fn __length_hint__(&self) -> usize {
        match &*self.scans.lock() {
            Scans::Input(scans) => scans.len_hint().unwrap_or(0),
            Scans::Kept(_, left) => *left,
        }
    }
}

/// Iterates over the scans of a file or folder of any format that the command reads: points in the sensor's frame
/// (`float64`, N x 3), the pose (4 x 4) and intensities (`float32`, or `None`).
///
/// Of a map that keeps its scans, these. `poses` is a file of poses, or "identity"; `topic`, `odometry` and `fixed_frame` choose from a recording; `first`,
/// `count` and `every` choose scans.
#[pyfunction]
#[pyo3(signature = (path, *, poses=None, topic=None, odometry=None, fixed_frame=None, first=0, count=None, every=1))]
#[expect(clippy::too_many_arguments, reason = "keywords, in Python")]
pub fn scans(
    py: Python<'_>,
    path: PathBuf,
    poses: Option<PathBuf>,
    topic: Option<String>,
    odometry: Option<String>,
    fixed_frame: Option<String>,
    first: u64,
    count: Option<u64>,
    every: u64,
) -> PyResult<ScanIterator> {
    let recording = RecordingOptions { topic, odometry_topic: odometry, fixed_frame };
    let options = options_of(poses, recording, (first, count, every));
    let scans = watched(py, |_| {
        if !(path.join("metadata.json").is_file() && path.join("commits.log").is_file()) {
            return Ok(Scans::Input(open_any_scans(&path, &options)?));
        }
        if options.poses.is_some() || !options.selection.is_everything() {
            return Err(Error::argument(
                "scans",
                "those that a map keeps are read as they are; leave the options out",
            ));
        }
        let reader = MapReader::open(&path, 1)?;
        let (mut records, mut count) = (reader.kept_scans()?, 0);
        while records.next_record()?.is_some() {
            count += 1;
        }
        Ok(Scans::Kept(Box::new(reader.kept_scans()?), count))
    })?;
    Ok(ScanIterator { scans: Mutex::new(scans) })
}

/// Makes a map of a file or folder of scans, as `voxtile build` does; returns one report of all scans.
///
/// Keywords are those of `Map.create` and of `scans`. `progress` is called with the scans done and their number, 0 if
/// it is not known. If it ends early, the map has the scans of the last flush.
#[pyfunction]
#[pyo3(signature = (path, output, *, resolution=0.1, tile_size=10.0, min_range=0.0, max_range=None,
    insert_mode="per-scan", sensor_model="log-odds", probabilities=None, occupancy_threshold=0.5, storage="octomap",
    memory=None, poses=None, topic=None, odometry=None, fixed_frame=None, first=0, count=None, every=1, keep_scans=false,
    progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords, in Python")]
pub fn build(
    py: Python<'_>,
    path: PathBuf,
    output: PathBuf,
    resolution: f64,
    tile_size: f64,
    min_range: f64,
    max_range: Option<f64>,
    insert_mode: &str,
    sensor_model: &str,
    probabilities: Option<[f64; 4]>,
    occupancy_threshold: f64,
    storage: &str,
    memory: Option<Bound<'_, PyAny>>,
    poses: Option<PathBuf>,
    topic: Option<String>,
    odometry: Option<String>,
    fixed_frame: Option<String>,
    first: u64,
    count: Option<u64>,
    every: u64,
    keep_scans: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<InsertReport> {
    let config = config_of(
        py,
        &ConfigArguments {
            resolution,
            tile_size,
            min_range,
            max_range,
            insert_mode,
            sensor_model,
            probabilities,
            occupancy_threshold,
            storage,
            memory,
            keep_scans,
        },
    )?;
    let recording = RecordingOptions { topic, odometry_topic: odometry, fixed_frame };
    let options = options_of(poses, recording, (first, count, every));
    let total = watched_with_progress(py, progress, |stop, progress| {
        let mut scans = open_any_scans(&path, &options)?;
        let all = scans.len_hint().unwrap_or(0) as u64;
        let room = PointRoom::new(MOST_SCAN_BYTES, output.parent().unwrap_or(Path::new(".")));
        // A first scan that cannot be read leaves no empty map behind.
        let mut next = scans.next_stored(&room)?;
        let mut mapper = OutOfCoreTileMapper::create(&output, config)?;
        mapper.stop_with(stop.clone());
        mapper.begin_input(path.display().to_string())?;
        let (mut total, mut done, mut flushed) = (ScanReport::default(), 0, Instant::now());
        while let Some(scan) = next {
            total += mapper.insert_points(&scan)?;
            done += 1;
            progress.tell(done, all);
            if flushed.elapsed() > BETWEEN_FLUSHES {
                mapper.flush()?;
                flushed = Instant::now();
            }
            next = scans.next_stored(&room)?;
        }
        mapper.flush()?;
        Ok(total)
    })?;
    Ok(total.into())
}

fn options_of(
    poses: Option<PathBuf>,
    recording: RecordingOptions,
    (first, count, every): (u64, Option<u64>, u64),
) -> ReadOptions {
    let mut options = ReadOptions::default();
    options.poses = poses;
    options.recording = recording;
    (options.selection.first, options.selection.count, options.selection.every) = (first, count, every);
    options
}
