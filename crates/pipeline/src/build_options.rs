use crate::flush_schedule::FlushEvery;
use crate::scan_queue::WhenBehind;
use std::path::PathBuf;
use std::time::Duration;
use voxtile::space::Aabb;
use voxtile::{InsertMode, MemoryLimit, OctreeConfig, Storage};
use voxtile_formats::ReadOptions;

/// How observations become evidence, without the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorModelKind {
    /// OctoMap's: constant log-odds for hit and miss.
    LogOdds,
    /// Intensity-weighted log-odds, for sonar, radar and lidar intensity.
    Iwlo,
}

/// What a build is asked for. `None` is the map's own value; of a new map, or of rays that a build begins with, the
/// default that is named here.
#[derive(Clone, Debug)]
pub struct BuildOptions {
    /// The scans: a file, a folder, a URL, a map, or `-` for a scan stream from standard input.
    pub scans: PathBuf,
    /// How they are read.
    pub read: ReadOptions,
    /// Folder of the map.
    pub output: PathBuf,
    /// Edge of a voxel in metres: 0.1.
    pub resolution_m: Option<f64>,
    /// Edge of a tile in metres: 10.
    pub tile_size_m: Option<f64>,
    /// How tiles are stored: as OctoMap's files.
    pub storage: Option<Storage>,
    /// Limit of memory.
    pub memory: MemoryLimit,
    /// Points nearer to the sensor than this are skipped, in metres: 0.
    pub min_range_m: Option<f64>,
    /// Rays are cut at this range in metres: 100.
    pub max_range_m: Option<f64>,
    /// How observations become evidence: by constant log-odds.
    pub sensor_model: Option<SensorModelKind>,
    /// Probabilities of a hit and a miss, and the least and most that a voxel gets.
    pub probabilities: Option<[f64; 4]>,
    /// Probability from which a voxel counts as occupied: 0.5.
    pub occupancy_threshold: Option<f64>,
    /// Intensities up to this one are no evidence, in the sensor's unit: 35.
    pub intensity_threshold: Option<f64>,
    /// Intensity of full weight, in the sensor's unit: 255.
    pub intensity_max: Option<f64>,
    /// How often one scan updates a voxel: once.
    pub insert_mode: Option<InsertMode>,
    /// Whether the map keeps the scans. One that does goes on doing so.
    pub keep_scans: bool,
    /// Only tiles whose center is in this box are mapped.
    pub region: Option<Aabb>,
    /// Rays without a return clear up to so many metres: they clear nothing.
    pub clear_no_return_m: Option<f64>,
    /// Whether points are hits alone, without rays.
    pub no_rays: bool,
    /// Whether scans may be added to a map.
    pub append: bool,
    /// Whether to go on with an input that the map has scans of.
    pub resume: bool,
    /// Whether to add scans that the map has once more.
    pub again: bool,
    /// Whether scans that cannot be read are skipped.
    pub skip_bad: bool,
    /// Whether poses that do not fit the scans are refused, before anything is mapped, in place of a remark.
    pub strict: bool,
    /// When the map is flushed: every 60 s, beside scans.
    pub flush_every: FlushEvery,
    /// What becomes of scans that come faster than they can be mapped.
    pub when_behind: WhenBehind,
    /// What tiles keep for coarse queries; no answer and no file depends on it.
    pub octree: OctreeConfig,
    /// The map is made as a piece with this id, and is not durable. Whoever crashes makes it again, and
    /// [`operations::move_shard`](voxtile::operations::move_shard()) makes it durable.
    pub piece_of: Option<[u8; 16]>,
}

impl BuildOptions {
    /// A build of these scans into a new map, with all defaults.
    pub fn new(scans: impl Into<PathBuf>, output: impl Into<PathBuf>) -> Self {
        Self {
            scans: scans.into(),
            read: ReadOptions::default(),
            output: output.into(),
            resolution_m: None,
            tile_size_m: None,
            storage: None,
            memory: MemoryLimit::default(),
            min_range_m: None,
            max_range_m: None,
            sensor_model: None,
            probabilities: None,
            occupancy_threshold: None,
            intensity_threshold: None,
            intensity_max: None,
            insert_mode: None,
            keep_scans: false,
            region: None,
            clear_no_return_m: None,
            no_rays: false,
            append: false,
            resume: false,
            again: false,
            skip_bad: false,
            strict: false,
            flush_every: FlushEvery::Time(Duration::from_secs(60)),
            when_behind: WhenBehind::Wait,
            octree: OctreeConfig::default(),
            piece_of: None,
        }
    }
}
