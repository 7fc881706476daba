use super::{ReadArgs, help};
use bytesize::ByteSize;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use voxtile::{Clearing, Layers, Storage};
use voxtile_pipeline::{FlushEvery, WhenBehind};

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct BuildArgs {
    #[arg(value_name = "SCANS", required = true, help = help::SCANS_OR_MAP)]
    pub scans: Vec<PathBuf>,
    #[arg(short = 'o', long = "output", value_name = "MAP", help = help::MAP)]
    pub output: PathBuf,
    /// Edge length of a voxel, in metres [default: 0.1, or the map's]
    #[arg(long, value_name = "M")]
    pub resolution: Option<f64>,
    /// Edge length of a tile, in metres, 2 to 1024 whole voxels [default: the multiple of the resolution nearest to 10,
    /// of at most 256 voxels (0.15: 10.05), or the map's]
    #[arg(long, value_name = "M")]
    pub tile_size: Option<f64>,
    /// Storage format of the tiles of a new map; `voxtile convert` changes it later [default: octomap, or the map's]
    #[arg(long, value_name = "FORM")]
    pub storage: Option<StorageName>,
    #[arg(long, value_name = "SIZE", conflicts_with = "cache_tiles", help = help::MEMORY)]
    pub memory: Option<ByteSize>,
    /// Maximum number of tiles in memory, whatever their size; replaces --memory
    #[arg(long, value_name = "N")]
    pub cache_tiles: Option<usize>,
    /// Skip points nearer to the sensor than this, in metres [default: 0; with --resume, the earlier value]
    #[arg(long, value_name = "M")]
    pub min_range: Option<f64>,
    /// Cut rays at this range, in metres: space before it becomes free, without a hit [default: 100; with --resume, the
    /// earlier value]
    #[arg(long, value_name = "M")]
    pub max_range: Option<f64>,
    /// Sensor model that turns observations into log-odds [default: log-odds, or the map's]
    #[arg(long, value_name = "MODEL")]
    pub sensor_model: Option<ModelName>,
    /// log-odds model: probabilities of a hit and of a miss, and the limits of a voxel's probability [default: 0.7 0.4
    /// 0.1192 0.971]
    #[arg(long, value_names = ["HIT", "MISS", "MIN", "MAX"], num_args = 4)]
    pub probabilities: Option<Vec<f64>>,
    /// Minimum probability of an occupied voxel, for a new map [default: 0.5]
    #[arg(long, value_name = "P")]
    pub occupancy_threshold: Option<f64>,
    /// iwlo model: ignore points up to this intensity, in the sensor's unit [default: 35]
    #[arg(long, value_name = "I")]
    pub intensity_threshold: Option<f64>,
    /// iwlo model: intensity of full weight, in the sensor's unit [default: 255]
    #[arg(long, value_name = "I")]
    pub intensity_max: Option<f64>,
    /// Number of updates of a voxel per scan [default: per-scan; with --resume, the earlier value]
    #[arg(long, value_name = "MODE")]
    pub insert: Option<InsertName>,
    /// Rule that selects which misses of a scan clear known voxels, for a new map [default: octomap, or the map's]
    #[arg(long, value_name = "RULE")]
    pub clearing: Option<ClearingName>,
    /// What a new map stores of the points that hit a voxel: a list of colour, intensity, class, time and shape.
    /// intensity=MAX sets the largest intensity, in the sensor's unit [default: none, or those of the map;
    /// intensity=255]
    #[arg(long, value_name = "LIST")]
    pub layers: Option<Layers>,
    /// Keep the scans in the map, compressed to about 10 bytes per point, for remap, remove-scans and remove-points. A
    /// map that keeps scans continues to do so
    #[arg(long)]
    pub keep_scans: bool,
    /// Map only tiles whose center is in this box (X0 <= x < X1, same for y and z), in metres; -inf and inf are
    /// allowed. Maps of adjacent boxes can be merged into one map [default: all of space; with --resume, the earlier
    /// value]
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6, allow_hyphen_values = true)]
    pub region: Option<Vec<f64>>,
    /// Clear rays without a return up to this range, in metres, at most --max-range; for laser scans, depth images and
    /// e57 [default: no clearing; with --resume, the earlier value]
    #[arg(long, value_name = "M")]
    pub clear_no_return: Option<f64>,
    /// Insert points as hits only, without clearing rays; needs no poses
    #[arg(long)]
    pub no_rays: bool,
    /// Add the scans to an existing map that has no scans of this input yet
    #[arg(long)]
    pub append: bool,
    /// Continue an interrupted build, or insert the new scans of an input that has grown. Without a map, start one;
    /// with --append, start the input in an existing map. Each scan is inserted once, however often this is repeated
    #[arg(long)]
    pub resume: bool,
    /// Add the scans even if the map has scans of this input already; they count again
    #[arg(long, requires = "append", conflicts_with = "resume")]
    pub again: bool,
    /// Skip scans that cannot be read and list them, instead of failing
    #[arg(long)]
    pub skip_bad: bool,
    /// Fail if the poses do not fit the scans, which is otherwise a warning. Some of the first scans are compared with
    /// the scans before them
    #[arg(long)]
    pub strict: bool,
    /// Flush the map every N seconds while mapping continues (60s), every N scans with a pause (25), or only at the end
    /// (end); a crash loses the scans since the last flush
    #[arg(long, value_name = "N", default_value = "60s")]
    pub flush_every: FlushEvery,
    /// Handling of scans from standard input or a pipe that arrive faster than they can be mapped; dropped scans are
    /// counted
    #[arg(long, value_name = "HOW", default_value = "wait")]
    pub when_behind: WhenBehindName,
    #[arg(long, help = help::JSON)]
    pub json: bool,
    #[command(flatten)]
    pub read: ReadArgs,
    #[command(flatten)]
    pub octree: OctreeArgs,
}

/// Options of the octrees for coarse queries. They change neither results nor files.
#[derive(Debug, Args)]
#[command(next_help_heading = "Octrees (no effect on the content of the map)")]
pub struct OctreeArgs {
    /// Octree of a tile for coarse queries [default: bricks, or pointers with a voxel cache]
    #[arg(long, value_name = "FORM")]
    pub octree: Option<OctreeName>,
    /// Cache between updates and the pointer octree; serial and parallel imply --octree pointers [default: off]
    #[arg(long, value_name = "MODE")]
    pub voxel_cache: Option<VoxelCacheName>,
    /// With a voxel cache: maximum number of voxels that stay in a bucket after a scan, 1 to 65536 [default: 4]
    #[arg(long, value_name = "N")]
    pub tau: Option<usize>,
    /// Number of buckets of each tile's voxel cache, a power of two [default: enough for 3 times the voxels of a scan
    /// in the tile]
    #[arg(long, value_name = "N")]
    pub buckets: Option<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum OctreeName {
    /// Computed from the stored voxels
    Bricks,
    /// OctoMap's pointer tree, for comparison: much slower, ten times the memory
    Pointers,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum VoxelCacheName {
    /// No cache: every update goes directly to the pointer octree, as in OctoMap
    Off,
    /// Write evicted voxels to the pointer octree after each scan, as in OctoCache
    Serial,
    /// Same as serial, but a separate thread writes the pointer octrees
    Parallel,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum StorageName {
    /// Two files per tile that other programs read: iwlo_meta.bin, 18 bytes per voxel, and octree.bt
    #[value(name = "octomap")]
    OctoMap,
    /// One file per tile, 20 to 40 times smaller
    Compact,
}

impl From<StorageName> for Storage {
    fn from(name: StorageName) -> Self {
        match name {
            StorageName::OctoMap => Self::OctoMap,
            StorageName::Compact => Self::Compact,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WhenBehindName {
    /// Block the input
    Wait,
    /// Drop the oldest waiting scan
    DropOldest,
    /// Drop every second scan while the queue is more than half full, then the oldest waiting scan
    Thin,
}

impl From<WhenBehindName> for WhenBehind {
    fn from(name: WhenBehindName) -> Self {
        match name {
            WhenBehindName::Wait => Self::Wait,
            WhenBehindName::DropOldest => Self::DropOldest,
            WhenBehindName::Thin => Self::Thin,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ModelName {
    /// OctoMap's model: constant log-odds for a hit and a miss
    LogOdds,
    /// Intensity-weighted log-odds, for sonar, radar and lidar intensity
    Iwlo,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ClearingName {
    /// All misses, as in OctoMap. Rays that graze a surface erase some of its voxels
    Octomap,
    /// Misses away from surfaces. Misses near surfaces only make unknown voxels free. Keeps roads, walls and poles
    Guarded,
}

impl From<ClearingName> for Clearing {
    fn from(name: ClearingName) -> Self {
        match name {
            ClearingName::Octomap => Self::Octomap,
            ClearingName::Guarded => Self::guarded(),
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum InsertName {
    /// One update per scan; a hit wins over any miss
    PerScan,
    /// One update per ray
    PerRay,
}
