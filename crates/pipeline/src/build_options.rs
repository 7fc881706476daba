use crate::flush_schedule::FlushEvery;
use crate::scan_queue::WhenBehind;
use std::path::PathBuf;
use std::time::Duration;
use voxtile::space::Aabb;
use voxtile::{Clearing, InsertMode, Layers, MemoryLimit, OctreeConfig, Storage};
use voxtile_formats::ReadOptions;

/// Sensor model, without its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorModelKind {
    /// OctoMap's model: constant log-odds for hits and misses.
    LogOdds,
    /// Intensity-weighted log-odds, for sonar, radar and lidar intensities.
    Iwlo,
}

/// Settings of a build. `None` means the map's own value; for a new map, or for the rays of a new input, it means the
/// default named here.
#[derive(Clone, Debug)]
pub struct BuildOptions {
    /// Scans: files, folders, URLs, maps, or `-` alone for a scan stream from standard input. They are mapped in this
    /// order. Consecutive files of clouds of one format and folder are one input, as the folder would be; any other
    /// path is an input of its own.
    pub scans: Vec<PathBuf>,
    /// Settings for reading the scans.
    pub read: ReadOptions,
    /// Folder of the map.
    pub output: PathBuf,
    /// Edge of a voxel in metres. Default: 0.1.
    pub resolution_m: Option<f64>,
    /// Edge of a tile in metres. Default: the multiple of the resolution nearest to 10, as
    /// [`Grid::with_resolution`](voxtile::space::Grid::with_resolution) describes.
    pub tile_size_m: Option<f64>,
    /// Storage format of tiles. Default: OctoMap's.
    pub storage: Option<Storage>,
    /// Memory limit.
    pub memory: MemoryLimit,
    /// Minimum range in metres; nearer points are skipped. Default: 0.
    pub min_range_m: Option<f64>,
    /// Maximum range in metres; rays are cut there. Default: 100.
    pub max_range_m: Option<f64>,
    /// Sensor model. Default: constant log-odds.
    pub sensor_model: Option<SensorModelKind>,
    /// Probabilities of a hit and a miss, and the minimum and maximum probability of a voxel.
    pub probabilities: Option<[f64; 4]>,
    /// Minimum probability of an occupied voxel. Default: 0.5.
    pub occupancy_threshold: Option<f64>,
    /// Intensities up to this value are no evidence, in the sensor's unit. Default: 35.
    pub intensity_threshold: Option<f64>,
    /// Intensity with full weight, in the sensor's unit. Default: 255.
    pub intensity_max: Option<f64>,
    /// How often one scan can update a voxel. Default: once.
    pub insert_mode: Option<InsertMode>,
    /// Rule for the voxels that rays pass. Default: the map's, OctoMap's for a new map.
    pub clearing: Option<Clearing>,
    /// Layers of a new map. Default: none. An existing map has its own.
    pub layers: Option<Layers>,
    /// Whether the map keeps the scans. A map that keeps scans continues to do so.
    pub keep_scans: bool,
    /// Only tiles with their center in this box are updated.
    pub region: Option<Aabb>,
    /// Range up to which rays without a return clear space, in metres. Default: they clear nothing.
    pub clear_no_return_m: Option<f64>,
    /// Whether points are hits without rays.
    pub no_rays: bool,
    /// Whether scans may be added to an existing map.
    pub append: bool,
    /// Whether to resume an input of which the map has scans.
    pub resume: bool,
    /// Whether to add scans again that the map already has.
    pub again: bool,
    /// Whether to skip scans that cannot be read.
    pub skip_bad: bool,
    /// Whether poses that do not fit the scans are an error before anything is mapped, instead of a warning.
    pub strict: bool,
    /// When to flush the map. Default: every 60 s, in the background.
    pub flush_every: FlushEvery,
    /// Policy for scans that arrive faster than they can be inserted.
    pub when_behind: WhenBehind,
    /// Data that tiles keep for coarse queries. It does not affect results and files.
    pub octree: OctreeConfig,
    /// ID of the shard to build. A shard is not durable: after a crash it must be built again, and
    /// [`operations::move_shard`](voxtile::operations::move_shard()) makes it durable.
    pub piece_of: Option<[u8; 16]>,
    /// Number of the map's scans before those of the input, if the shard is part of an update.
    pub scans_before: u64,
}

impl BuildOptions {
    /// Creates the options for a new map with all defaults.
    pub fn new(scans: impl Into<PathBuf>, output: impl Into<PathBuf>) -> Self {
        Self {
            scans: vec![scans.into()],
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
            clearing: None,
            layers: None,
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
            scans_before: 0,
        }
    }
}
