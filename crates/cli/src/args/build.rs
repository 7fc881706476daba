use super::ReadArgs;
use bytesize::ByteSize;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use voxtile::Storage;
use voxtile_pipeline::{FlushEvery, WhenBehind};

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct BuildArgs {
    /// Scans: a folder of point clouds (PCD, PLY, LAS, KITTI .bin, depth images) in the sensor's frame or one that
    /// holds it as scans/, a recording (.bag .mcap .db3, a rosbag2 folder), one file (.laz .e57 .xyz ...), OctoMap's
    /// .graph and .log, a scan stream (.scans), a map that keeps its scans, or - for a scan stream from standard input
    #[arg(value_name = "SCANS")]
    pub scans: PathBuf,
    /// Folder of the map
    #[arg(short = 'o', long = "output", value_name = "MAP")]
    pub output: PathBuf,
    /// Edge of a voxel in metres [default: 0.1, or the map's own]
    #[arg(long, value_name = "M")]
    pub resolution: Option<f64>,
    /// Edge of a tile in metres, 2 to 1024 whole voxels [default: 10, or the map's own]
    #[arg(long, value_name = "M")]
    pub tile_size: Option<f64>,
    /// How the tiles of a new map are stored [default: octomap, or the map's own]
    #[arg(long, value_name = "FORM")]
    pub storage: Option<StorageName>,
    /// Most memory for all that grows with the map or with a scan (256MiB, 1GB); some 40 MB for the rest come on top
    /// [default: 512MiB, or what tiles of this size need at least]
    #[arg(long, value_name = "SIZE", conflicts_with = "cache_tiles")]
    pub memory: Option<ByteSize>,
    /// Most tiles kept in memory, however large, in place of --memory
    #[arg(long, value_name = "N")]
    pub cache_tiles: Option<usize>,
    /// Skip points nearer to the sensor than this, in metres [default: 0, or as begun with --resume]
    #[arg(long, value_name = "M")]
    pub min_range: Option<f64>,
    /// Cut rays at this range in metres: free up to there, nothing hit [default: 100, or as begun with --resume]
    #[arg(long, value_name = "M")]
    pub max_range: Option<f64>,
    /// How observations become evidence [default: log-odds, or the map's own]
    #[arg(long, value_name = "MODEL")]
    pub sensor_model: Option<ModelName>,
    /// log-odds: probabilities of a hit and a miss, and the least and most that a voxel gets
    /// [default: 0.7 0.4 0.1192 0.971]
    #[arg(long, value_names = ["HIT", "MISS", "MIN", "MAX"], num_args = 4)]
    pub probabilities: Option<Vec<f64>>,
    /// Probability from which a voxel counts as occupied, of a new map [default: 0.5]
    #[arg(long, value_name = "P")]
    pub occupancy_threshold: Option<f64>,
    /// iwlo: intensities up to this one are no evidence, in the sensor's unit [default: 35]
    #[arg(long, value_name = "I")]
    pub intensity_threshold: Option<f64>,
    /// iwlo: intensity of full weight, in the sensor's unit [default: 255]
    #[arg(long, value_name = "I")]
    pub intensity_max: Option<f64>,
    /// How often one scan updates a voxel [default: per-scan, or as begun with --resume]
    #[arg(long, value_name = "MODE")]
    pub insert: Option<InsertName>,
    /// Keep the scans in the map, compressed (some 10 bytes a point), so that it can be mapped again when poses change
    /// or scans have to go: see remap, remove-scans. A map that keeps scans goes on doing so
    #[arg(long)]
    pub keep_scans: bool,
    /// Map only the tiles whose center is in this box: X0 <= x < X1 and so on, in metres, -inf and inf included; maps
    /// of boxes that partition space merge to the map of the whole [default: all of space, or as begun with --resume]
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6, allow_hyphen_values = true)]
    pub region: Option<Vec<f64>>,
    /// Rays without a return clear up to so many metres, or --max-range if that is less: laser scans, depth images,
    /// e57 [default: they clear nothing, or as begun with --resume]
    #[arg(long, value_name = "M")]
    pub clear_no_return: Option<f64>,
    /// Take points as hits alone: no rays, nothing is cleared; no poses are needed
    #[arg(long)]
    pub no_rays: bool,
    /// Add the scans to an existing map, which must not have scans of this input yet
    #[arg(long)]
    pub append: bool,
    /// Go on with a build that was interrupted, or with an input that has grown; or begin it, where there is no map or
    /// with --append: every scan counts exactly once, however often the command is repeated
    #[arg(long)]
    pub resume: bool,
    /// Add the scans even if the map has scans of this input: they count once more
    #[arg(long, requires = "append", conflicts_with = "resume")]
    pub again: bool,
    /// Go past scans that cannot be read, and say which, in place of ending with an error
    #[arg(long)]
    pub skip_bad: bool,
    /// Refuse poses that do not fit the scans, in place of a remark: some of the first scans are compared with those
    /// before
    #[arg(long)]
    pub strict: bool,
    /// Make durable what was mapped every so many seconds while mapping goes on (60s), or stop every N scans for it
    /// (25), or only at the end (end): what a crash can lose
    #[arg(long, value_name = "N", default_value = "60s")]
    pub flush_every: FlushEvery,
    /// What becomes of scans from standard input or a pipe that come faster than they can be mapped; those left out are
    /// counted
    #[arg(long, value_name = "HOW", default_value = "wait")]
    pub when_behind: WhenBehindName,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub read: ReadArgs,
    #[command(flatten)]
    pub octree: OctreeArgs,
}

/// What tiles keep for coarse queries; no answer and no file depends on it.
#[derive(Debug, Args)]
#[command(next_help_heading = "Octrees (the map is the same with any)")]
pub struct OctreeArgs {
    /// What tiles keep for coarse queries [default: bricks, or pointers with a voxel cache]
    #[arg(long, value_name = "FORM")]
    pub octree: Option<OctreeName>,
    /// What stands between updates and the pointer octree; serial and parallel imply --octree pointers [default: off]
    #[arg(long, value_name = "MODE")]
    pub voxel_cache: Option<VoxelCacheName>,
    /// Most voxels that a bucket of a voxel cache keeps after a scan, 1 to 65536 [default: 4]
    #[arg(long, value_name = "N")]
    pub tau: Option<usize>,
    /// Number of buckets of each tile's voxel cache, a power of two [default: as many as hold 3 times the voxels that a
    /// scan has in the tile]
    #[arg(long, value_name = "N")]
    pub buckets: Option<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum OctreeName {
    /// A view of the voxels themselves, which needs no cache
    Bricks,
    /// OctoMap's pointer tree, for study and comparison: much slower, ten times the memory
    Pointers,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum VoxelCacheName {
    /// None: every update goes straight into a pointer octree (OctoMap); bricks never have one
    Off,
    /// After each scan, what leaves the cache goes into the pointer octree (OctoCache)
    Serial,
    /// The same, with the pointer octrees written by a thread of their own
    Parallel,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum StorageName {
    /// Two files a tile that other programs read: iwlo_meta.bin, 18 bytes a voxel, and octree.bt
    #[value(name = "octomap")]
    OctoMap,
    /// One file a tile, a twentieth to a fortieth of the bytes; convert makes the other form of it
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

/// What becomes of scans that come faster than they can be mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WhenBehindName {
    /// The input waits
    Wait,
    /// The oldest scan that waits makes room
    DropOldest,
    /// While more than half of the room is taken, every second scan is left out; then as drop-oldest
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
    /// OctoMap's: constant log-odds for hit and miss
    LogOdds,
    /// Intensity-weighted log-odds, for sonar, radar and lidar intensity
    Iwlo,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum InsertName {
    /// Once; a hit wins over any miss
    PerScan,
    /// Once for every ray
    PerRay,
}
