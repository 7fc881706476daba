//! Conversion of Python keywords to the options of builds and exports. Keywords that are not passed take the options'
//! defaults.

use crate::errors::{exception, wrong};
use crate::keywords::Keywords;
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use voxtile::space::Aabb;
use voxtile::{Clearing, InsertMode, MemoryLimit, Storage};
use voxtile_formats::write::FileUnit;
use voxtile_formats::{ReadOptions, Returns};
use voxtile_pipeline::numbers::{Mount, point_of, region_of, set_mount, step_of_points_m, tolerance_ns};
use voxtile_pipeline::{BuildOptions, ExportOptions, SensorModelKind, WhenBehind, WhichVoxels};

pub const STORAGES: [(&str, Storage); 2] = [("octomap", Storage::OctoMap), ("compact", Storage::Compact)];
pub const INSERT_MODES: [(&str, InsertMode); 2] =
    [("per-scan", InsertMode::PerScan), ("per-ray", InsertMode::PerRay)];
/// Clearing rules by their names in Python.
pub fn clearings() -> [(&'static str, Clearing); 2] {
    [("octomap", Clearing::Octomap), ("guarded", Clearing::guarded())]
}
const SENSOR_MODELS: [(&str, SensorModelKind); 2] =
    [("log-odds", SensorModelKind::LogOdds), ("iwlo", SensorModelKind::Iwlo)];
const WHEN_BEHIND: [(&str, WhenBehind); 3] =
    [("wait", WhenBehind::Wait), ("drop-oldest", WhenBehind::DropOldest), ("thin", WhenBehind::Thin)];
const WHICH_VOXELS: [(&str, WhichVoxels); 3] =
    [("occupied", WhichVoxels::Occupied), ("free", WhichVoxels::Free), ("all", WhichVoxels::All)];
const RETURNS: [(&str, Returns); 3] =
    [("all", Returns::All), ("first", Returns::First), ("last", Returns::Last)];
/// Whether the box of ignored points is in the body's frame.
const FRAMES: [(&str, bool); 2] = [("sensor", false), ("body", true)];

/// Takes the options for reading scans (`voxtile.files.ReadOptions`) from the keywords.
pub fn read_options(py: Python<'_>, keywords: &mut Keywords<'_>) -> PyResult<ReadOptions> {
    let raised = |error: voxtile::Error| exception(py, &error);
    let mut options = ReadOptions::default();
    options.format = keywords.text("format")?;
    options.fields = keywords.texts("fields")?;
    options.scan_period_s = keywords.number("scan_period")?.unwrap_or(options.scan_period_s);
    let origin = keywords.numbers("sensor_origin")?;
    options.sensor_origin_m =
        origin.map(|numbers| point_of("sensor_origin", &numbers)).transpose().map_err(raised)?;
    options.depth_scale = keywords.number("depth_scale")?;
    options.intrinsics_path = keywords.path("intrinsics")?;
    let clouds = &mut options.clouds;
    if let Some(seconds) = keywords.number("pose_tolerance")? {
        clouds.pose_tolerance_ns = tolerance_ns(seconds).map_err(raised)?;
    }
    clouds.is_world_frame = keywords.flag("world_frame")?;
    clouds.is_deskewed = keywords.flag("deskew")?;
    let selection = &mut options.selection;
    selection.first = keywords.count("first")?.unwrap_or(selection.first);
    selection.count = keywords.count("count")?;
    selection.every = keywords.count("every")?.unwrap_or(selection.every);
    selection.ignored = region(py, keywords, "ignore_box")?;
    selection.step_m = keywords.number("round_points")?.map(step_of_points_m).transpose().map_err(raised)?;
    options.classes.only_class = classes(py, keywords, "only_class")?;
    options.classes.skip_class = classes(py, keywords, "skip_class")?;
    options.returns = keywords.one_of("returns", &RETURNS)?.unwrap_or_default();
    let recording = &mut options.recording;
    recording.topic = keywords.text("topic")?;
    recording.odometry_topic = keywords.text("odometry")?;
    recording.fixed_frame = keywords.text("fixed_frame")?;
    options.poses = keywords.path("poses")?;
    options.calib = keywords.path("calib")?;
    let mount = keywords.numbers("extrinsic")?.map(|mut numbers| {
        // The last row of a 4 x 4 matrix is constant.
        if numbers.len() == 16 {
            numbers.truncate(12);
        }
        Mount::of(&numbers)
    });
    let mount = mount.transpose().map_err(raised)?;
    let is_box_of_body = keywords.one_of("ignore_frame", &FRAMES)?.unwrap_or(false);
    set_mount(&mut options, mount, is_box_of_body).map_err(raised)?;
    Ok(options)
}

/// Returns the number of a class.
fn class_of(py: Python<'_>, name: &str, class: f64) -> PyResult<u8> {
    let is_class = (0.0..=255.0).contains(&class) && class.fract() == 0.0;
    let reason = || wrong(py, name, format!("must be whole numbers from 0 to 255, not {class}"));
    is_class.then_some(class as u8).ok_or_else(reason)
}

/// Takes the options of a build (`voxtile.files.BuildOptions`) from the keywords.
pub fn build_options(
    py: Python<'_>,
    scans: Paths,
    output: PathBuf,
    mut keywords: Keywords<'_>,
) -> PyResult<BuildOptions> {
    let mut options = BuildOptions { scans: scans.without_stream(), ..BuildOptions::new("", output) };
    options.read = read_options(py, &mut keywords)?;
    options.resolution_m = keywords.number("resolution")?;
    options.tile_size_m = keywords.number("tile_size")?;
    options.storage = keywords.one_of("storage", &STORAGES)?;
    options.memory = keywords.bytes("memory")?.map_or(MemoryLimit::Default, MemoryLimit::Bytes);
    options.min_range_m = keywords.number("min_range")?;
    options.max_range_m = keywords.number("max_range")?;
    options.sensor_model = keywords.one_of("sensor_model", &SENSOR_MODELS)?;
    options.probabilities =
        match keywords.numbers("probabilities")? {
            Some(numbers) => Some(numbers.try_into().map_err(|_| {
                wrong(py, "probabilities", "must be four numbers: hit, miss, minimum, maximum")
            })?),
            None => None,
        };
    options.occupancy_threshold = keywords.number("occupancy_threshold")?;
    options.intensity_threshold = keywords.number("intensity_threshold")?;
    options.intensity_max = keywords.number("intensity_max")?;
    options.insert_mode = keywords.one_of("insert_mode", &INSERT_MODES)?;
    options.clearing = keywords.one_of("clearing", &clearings())?;
    options.layers = keywords.parsed("layers", str::parse)?;
    options.keep_scans = keywords.flag("keep_scans")?;
    options.region = region(py, &mut keywords, "region")?;
    options.clear_no_return_m = keywords.number("clear_no_return")?;
    options.no_rays = keywords.flag("no_rays")?;
    options.append = keywords.flag("append")?;
    options.resume = keywords.flag("resume")?;
    options.again = keywords.flag("again")?;
    options.skip_bad = keywords.flag("skip_bad")?;
    options.strict = keywords.flag("strict")?;
    options.flush_every = keywords.parsed("flush_every", str::parse)?.unwrap_or(options.flush_every);
    options.when_behind = keywords.one_of("when_behind", &WHEN_BEHIND)?.unwrap_or(options.when_behind);
    keywords.end()?;
    Ok(options)
}

/// Takes a list of classes; empty without one.
fn classes(py: Python<'_>, keywords: &mut Keywords<'_>, name: &'static str) -> PyResult<Vec<u8>> {
    let numbers = keywords.numbers(name)?.unwrap_or_default();
    numbers.into_iter().map(|class| class_of(py, name, class)).collect()
}

/// Takes the options of an export (`voxtile.files.ExportOptions`) from the keywords.
pub fn export_options(
    py: Python<'_>,
    map: PathBuf,
    output: &Path,
    mut keywords: Keywords<'_>,
) -> PyResult<ExportOptions> {
    let raised = |error: voxtile::Error| exception(py, &error);
    let mut options = ExportOptions::new(map, no_stream(output));
    options.format = keywords.text("format")?;
    let what = keywords.one_of("what", &WHICH_VOXELS)?;
    let min_probability = keywords.number("min_probability")?.map(WhichVoxels::AtLeast);
    if what.is_some() && min_probability.is_some() {
        return Err(wrong(py, "min_probability", "cannot be combined with `what`; leave one of the two out"));
    }
    options.which = min_probability.or(what);
    options.with_layers = !keywords.flag("no_layers")?;
    options.mean_points = keywords.flag("mean_points")?;
    options.only_classes = classes(py, &mut keywords, "only_class")?;
    options.z_min_m = keywords.number("z_min")?;
    options.z_max_m = keywords.number("z_max")?;
    options.cell_m = keywords.number("cell")?;
    options.is_quantized = keywords.flag("quantize")?;
    options.region = region(py, &mut keywords, "region")?;
    let origin = keywords.numbers("origin")?;
    options.origin_m = origin.map(|numbers| point_of("origin", &numbers)).transpose().map_err(raised)?;
    options.crs = keywords.text("crs")?;
    options.unit = keywords.one_of("unit", &FileUnit::ALL.map(|unit| (unit.name(), unit)))?;
    options.memory_bytes = keywords.bytes("memory")?.unwrap_or(options.memory_bytes);
    keywords.end()?;
    Ok(options)
}

/// One path, or a sequence of paths.
#[derive(FromPyObject)]
pub enum Paths {
    One(PathBuf),
    Several(Vec<PathBuf>),
}

impl Paths {
    /// Returns the paths of files and folders. Here `-` is a file name, not standard input.
    pub fn without_stream(self) -> Vec<PathBuf> {
        match self {
            Self::One(path) => vec![no_stream(&path)],
            Self::Several(paths) => paths.iter().map(|path| no_stream(path)).collect(),
        }
    }
}

/// Returns the path of a file or folder. Here `-` is a file name, not standard input.
fn no_stream(path: &Path) -> PathBuf {
    if path.as_os_str() == "-" { Path::new(".").join(path) } else { path.to_owned() }
}

pub fn region(py: Python<'_>, keywords: &mut Keywords<'_>, name: &'static str) -> PyResult<Option<Aabb>> {
    let corners = keywords.numbers(name)?;
    corners.map(|corners| region_of(name, &corners)).transpose().map_err(|error| exception(py, &error))
}
