mod edit;
mod picture;
mod read;
mod snapshot;
#[cfg(feature = "view")]
mod view;

use crate::flush_schedule::FlushEvery;
use bytesize::ByteSize;
use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
pub use edit::{ClearArgs, CropArgs, DecayArgs, MergeArgs, PartArgs};
use log::LevelFilter;
pub use picture::{PictureArgs, ReportArgs, TerminalArgs, ViewName};
pub use read::{FrameName, ReadArgs};
pub use snapshot::{DiffArgs, RevertArgs, SnapshotArgs, SnapshotsArgs};
use std::ffi::OsString;
use std::path::PathBuf;
#[cfg(feature = "view")]
pub use view::ViewArgs;
use voxtile::Storage;

/// Probabilistic 3D occupancy mapping whose map is bounded by the disk, never by memory.
///
/// Lengths are metres, coordinates are in the world frame.
#[derive(Debug, Parser)]
#[command(name = "voxtile", version, propagate_version = true, max_term_width = 80)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
    /// Most threads to work with; the result is the same for any number [default: one a core]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Say what is done: -v flushes and the like, -vv each tile that comes and goes. RUST_LOG chooses by module
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub verbose: u8,
    /// Say nothing but errors: no warnings, no progress bars
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
}

impl Cli {
    /// What the command line says of the log; warnings if nothing.
    pub fn log_level(&self) -> LevelFilter {
        match (self.quiet, self.verbose) {
            (true, _) => LevelFilter::Error,
            (false, 0) => LevelFilter::Warn,
            (false, 1) => LevelFilter::Info,
            (false, _) => LevelFilter::Debug,
        }
    }
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Build a map from scans, or add scans to one
    Build(BuildArgs),
    /// Say what would be read of an input, or list the scans of a map
    Scans(ScansArgs),
    /// Make a map of a file of OctoMap (.bt .ot)
    Import(ImportArgs),
    /// Say what a map holds
    Info(InfoArgs),
    /// Ask whether places are occupied, free or unknown
    Query(QueryArgs),
    /// Find the first occupied voxel on a ray
    Raycast(RaycastArgs),
    /// Write a map's voxels to a file for other programs, or its surface, or its octree
    Export(ExportArgs),
    /// Draw a map: from above, cut at a height, from a side, or what has changed; as PNG or into the terminal
    Picture(PictureArgs),
    /// Write a page about a map: pictures, numbers, histograms, damage; one file that needs no network
    Report(ReportArgs),
    /// Print the digest of a map's content: equal for equal maps
    Digest(DigestArgs),
    /// Keep a map as it is under a name, at next to no cost; or delete such a snapshot
    Snapshot(SnapshotArgs),
    /// List a map's snapshots
    Snapshots(SnapshotsArgs),
    /// Say in what two maps differ, or two snapshots of a map
    Diff(DiffArgs),
    /// Make a map again what it was when a snapshot was made, in place
    Revert(RevertArgs),
    /// Make one map of several
    Merge(MergeArgs),
    /// Make a map of a part of another
    Crop(CropArgs),
    /// Make a part of a map unknown, in place
    Clear(ClearArgs),
    /// Let the evidence of a map fade by the scans that have come since, in place
    Decay(DecayArgs),
    /// Write a map anew with another storage: small, or as other programs read it; the content stays, to the bit, and
    /// snapshots are not taken along
    Convert(ConvertArgs),
    /// Check every file of a map for damage; exit code 1 if there is any
    Verify(VerifyArgs),
    /// Do what is possible for a damaged map; what cannot stay goes to quarantine/, nothing is deleted; exit code 1 if
    /// there is such a thing
    Repair(RepairArgs),
    /// Look at maps in a browser: a server on this machine, and a page that needs no network
    #[cfg(feature = "view")]
    View(ViewArgs),
    /// Run scans through a local map, as a planner needs it: sizes and times in a table, and a picture
    Local(LocalArgs),
    /// Share what is occupied with other robots over a network; runs voxtile-share, which comes separately
    #[command(disable_help_flag = true)]
    Share(ShareArgs),
    /// Map a small made-up city and draw it: a first look, no data needed
    Demo(DemoArgs),
    /// Print the completion script of a shell
    Completions(CompletionsArgs),
    /// Write the man pages into a folder
    Man(ManArgs),
}

impl Command {
    /// Whether it was asked for JSON.
    pub fn is_json(&self) -> bool {
        match self {
            Self::Build(args) => args.json,
            Self::Scans(args) => args.json,
            Self::Import(args) => args.json,
            Self::Info(args) => args.json,
            Self::Query(args) => args.json,
            Self::Raycast(args) => args.json,
            Self::Export(args) => args.json,
            Self::Picture(args) => args.json,
            Self::Report(args) => args.json,
            Self::Digest(args) => args.json,
            Self::Snapshot(args) => args.json,
            Self::Snapshots(args) => args.json,
            Self::Diff(args) => args.json,
            Self::Revert(args) => args.json,
            Self::Merge(args) => args.json,
            Self::Crop(args) => args.json,
            Self::Clear(args) => args.json,
            Self::Decay(args) => args.json,
            Self::Convert(args) => args.json,
            Self::Verify(args) => args.json,
            Self::Repair(args) => args.json,
            #[cfg(feature = "view")]
            Self::View(args) => args.json,
            Self::Local(args) => args.json,
            Self::Demo(args) => args.json,
            // What voxtile-share is asked for is its own to say.
            Self::Share(_) | Self::Completions(_) | Self::Man(_) => false,
        }
    }
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct BuildArgs {
    /// Scans: a folder of point clouds (PCD, PLY, LAS, KITTI .bin, depth images) in the sensor's frame or one that holds
    /// it as scans/, a recording (.bag .mcap .db3, a rosbag2 folder), one file (.laz .e57 .xyz ...), OctoMap's .graph and
    /// .log, a scan stream (.scans), or - for a scan stream from standard input
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
    /// iwlo: intensities up to this one are no evidence, in the sensor's unit [default: 35]
    #[arg(long, value_name = "I")]
    pub intensity_threshold: Option<f64>,
    /// iwlo: intensity of full weight, in the sensor's unit [default: 255]
    #[arg(long, value_name = "I")]
    pub intensity_max: Option<f64>,
    /// How often one scan updates a voxel [default: per-scan, or as begun with --resume]
    #[arg(long, value_name = "MODE")]
    pub insert: Option<InsertName>,
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
    /// Make durable what was mapped every N scans, or with s every so many seconds (25, 60s), or only at the end (end):
    /// what a crash can lose
    #[arg(long, value_name = "N", default_value = "60s")]
    pub flush_every: FlushEvery,
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

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ModelName {
    /// OctoMap's: constant log-odds for hit and miss
    LogOdds,
    /// Intensity-weighted log-odds, for sonar, radar and lidar intensity
    Iwlo,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ColorName {
    /// Height of the topmost occupied voxel
    Height,
    /// Highest probability in the column
    Probability,
    /// Most observations of a voxel in the column
    Count,
    /// Number of the scan after which its tile was last flushed
    LastScan,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum InsertName {
    /// Once; a hit wins over any miss
    PerScan,
    /// Once for every ray
    PerRay,
}

#[derive(Debug, Args)]
pub struct ShareArgs {
    /// Handed to voxtile-share as they are; --help lists them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    pub arguments: Vec<OsString>,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct ScansArgs {
    /// An input as for build, a map, or MAP@SNAPSHOT; nothing is mapped
    #[arg(value_name = "DATA")]
    pub data: PathBuf,
    /// List each scan: number, time stamp in seconds, origin in metres, points, name
    #[arg(long)]
    pub each: bool,
    /// Print JSON; with --each one object a scan, and the summary last
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub read: ReadArgs,
}

#[derive(Debug, Args)]
pub struct ImportArgs {
    /// A file of OctoMap: .bt has free and occupied voxels, .ot their log-odds
    pub file: PathBuf,
    /// Folder of the new map, which does not exist yet
    #[arg(short = 'o', long = "output", value_name = "MAP")]
    pub output: PathBuf,
    /// How the tiles of the map are stored
    #[arg(long, value_name = "FORM", default_value = "octomap")]
    pub storage: StorageName,
    /// Refuse a file that stands for more voxels: pruned cubes of a few bytes can stand for 2^48
    #[arg(long, value_name = "N", default_value_t = 1 << 32)]
    pub max_voxels: u64,
    /// Print JSON; sizes in bytes
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct InfoArgs {
    /// Folder of the map, FOLDER@SNAPSHOT, or an OctoMap file (.bt .ot)
    pub map: PathBuf,
    /// Draw nothing: a terminal gets a small picture of a map that is not large, unless NO_COLOR is set
    #[arg(long)]
    pub no_picture: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct QueryArgs {
    /// Folder of the map, FOLDER@SNAPSHOT, or an OctoMap file (.bt .ot)
    pub map: PathBuf,
    /// A point: X Y Z in metres
    #[arg(value_names = ["X", "Y", "Z"], num_args = 3, required_unless_present = "points")]
    pub point: Vec<f64>,
    /// A file of points, one a line: x y z in metres, separated by blanks or commas; - for standard input
    #[arg(long, value_name = "FILE", conflicts_with = "point")]
    pub points: Option<PathBuf>,
    /// Print JSON, one object a line
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct RaycastArgs {
    /// Folder of the map, FOLDER@SNAPSHOT, or an OctoMap file (.bt .ot)
    pub map: PathBuf,
    /// Where the ray begins, in metres
    #[arg(long, value_names = ["X", "Y", "Z"], num_args = 3, required = true)]
    pub origin: Vec<f64>,
    /// Where it goes; any length but 0
    #[arg(long, value_names = ["X", "Y", "Z"], num_args = 3, required = true)]
    pub direction: Vec<f64>,
    /// How far it goes, in metres [default: as far as the map reaches]
    #[arg(long, value_name = "M")]
    pub max_range: Option<f64>,
    /// Let unknown space stop the ray
    #[arg(long)]
    pub unknown_blocks: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct ExportArgs {
    /// Folder of the map, FOLDER@SNAPSHOT, or an OctoMap file (.bt .ot)
    pub map: PathBuf,
    /// File to write; its extension says what: .ply .pcd .csv .xyz .npz .las .laz .copc.laz .e57 .parquet .mcap hold
    /// voxels, .glb their surface, .pgm a flat map of nav2, .png heights, .bt .ot the whole octree. - is standard output
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    pub output: PathBuf,
    /// What to write, whatever the extension
    #[arg(long, value_name = "FORMAT")]
    pub format: Option<ExportFormatName>,
    /// Voxels of at least this probability; 0 takes all observed ones [default: the map's occupancy threshold]
    #[arg(long, value_name = "P")]
    pub min_probability: Option<f64>,
    /// Which voxels [default: occupied; all for .pgm]
    #[arg(long, value_name = "WHICH", conflicts_with = "min_probability")]
    pub what: Option<WhatName>,
    /// .pgm, .png: only voxels whose center is at least this high, in metres
    #[arg(long, value_name = "M")]
    pub z_min: Option<f64>,
    /// .pgm, .png: only voxels whose center is at most this high, in metres
    #[arg(long, value_name = "M")]
    pub z_max: Option<f64>,
    /// autoware: edge of the square of a file, in whole metres [default: 20]
    #[arg(long, value_name = "M")]
    pub cell: Option<f64>,
    /// Only voxels whose center is in this box: X0 <= x < X1 and so on, in metres
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6)]
    pub region: Option<Vec<f64>>,
    /// Coordinates in the file are those of the map less this, in metres: the nearest corner of a voxel, said in the
    /// summary and in FILE.origin.json. A map far from its origin needs it as .bt or .ot; a .pcd chooses one where
    /// float32 is too coarse [default: 0 0 0]
    #[arg(long, value_names = ["X", "Y", "Z"], num_args = 3)]
    pub origin: Option<Vec<f64>>,
    /// Memory for putting a .bt or .ot file together, beside that of one tile (64MiB, 1GiB)
    #[arg(long, value_name = "SIZE", default_value = "64MiB")]
    pub memory: ByteSize,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ExportFormatName {
    /// Points with doubles, probability, log-odds and count
    Ply,
    /// Points with float32, as PCL reads them
    Pcd,
    /// Text
    Csv,
    /// OctoMap's free and occupied voxels
    Bt,
    /// OctoMap's log-odds
    Ot,
    /// Text: x y z probability
    Xyz,
    /// NumPy arrays: xyz, log_odds, probability, count
    Npz,
    /// LAS 1.4 with log-odds and count as extra bytes
    Las,
    /// The same, compressed
    Laz,
    /// The same with levels of detail
    Copc,
    /// ASTM E57
    E57,
    /// Apache Parquet, where it was built in
    Parquet,
    /// A recording with PointCloud2, as Foxglove opens it
    Mcap,
    /// The surface of occupied voxels as binary glTF, Y-up
    Glb,
    /// A flat map of nav2: .pgm and .yaml
    Nav2,
    /// Heights as a 16-bit PNG with a world file
    Heightmap,
    /// A folder of PCD squares with the metadata of Autoware
    Autoware,
    /// A folder of 3D Tiles: the surface at every level of detail, as Cesium and others open it
    #[value(name = "3dtiles")]
    ThreeDTiles,
}

impl ExportFormatName {
    /// The name of the format.
    pub fn name(self) -> String {
        self.to_possible_value().map_or(String::new(), |value| value.get_name().to_owned())
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WhatName {
    /// From the map's threshold on
    Occupied,
    /// Observed and below it
    Free,
    /// All that were observed
    All,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct DigestArgs {
    /// Folder of the map, FOLDER@SNAPSHOT, or an OctoMap file (.bt .ot)
    pub map: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// Folder of the map, whose snapshots are checked too; a writer may be at work on it
    pub map: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct ConvertArgs {
    /// Folder of the map, or FOLDER@SNAPSHOT
    pub map: PathBuf,
    /// Folder of the new map, which does not exist yet
    #[arg(short = 'o', long = "output", value_name = "MAP")]
    pub output: PathBuf,
    /// How the tiles of the new map are stored
    #[arg(long, value_name = "FORM")]
    pub storage: StorageName,
    /// Print JSON; sizes in bytes
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct RepairArgs {
    /// Folder of the map
    pub map: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct DemoArgs {
    /// Folder for the map and the picture
    #[arg(long, value_name = "DIR", default_value = "voxtile_demo")]
    pub out: PathBuf,
    /// Which city
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Length of the drive in metres, a scan every two metres
    #[arg(long, value_name = "M", default_value_t = 400)]
    pub length: u32,
    /// Edge of a voxel in metres
    #[arg(long, value_name = "M", default_value_t = 0.2)]
    pub resolution: f64,
    /// How the tiles of the map are stored
    #[arg(long, value_name = "FORM", default_value = "octomap")]
    pub storage: StorageName,
    /// What the colors of the picture show
    #[arg(long, value_name = "WHAT", default_value = "height")]
    pub color: ColorName,
    /// Most tiles kept in memory
    #[arg(long, value_name = "N", default_value_t = 24)]
    pub cache_tiles: usize,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub octree: OctreeArgs,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct LocalArgs {
    /// Scans: a folder of point clouds (PCD, PLY, LAS, KITTI .bin, depth images) in the sensor's frame or one that holds
    /// it as scans/, a recording (.bag .mcap .db3, a rosbag2 folder), one file (.laz .e57 .xyz ...), OctoMap's .graph and
    /// .log, a scan stream (.scans), or - for a scan stream from standard input
    #[arg(value_name = "SCANS")]
    pub scans: PathBuf,
    /// What the map is for; table runs the setups a to e of the voxel mapping paper one after the other
    #[arg(long, value_name = "NAME", default_value = "local")]
    pub preset: PresetName,
    /// Most voxels with occupancy; 0 for no limit [default: the preset's]
    #[arg(long, value_name = "N")]
    pub n_lim: Option<usize>,
    /// Skip points farther from the sensor than this, in metres; inf for none [default: the preset's]
    #[arg(long, value_name = "M")]
    pub d_in: Option<f64>,
    /// Inflate up to this far from the sensor, in metres; inf for all [default: the preset's]
    #[arg(long, value_name = "M")]
    pub d_inf: Option<f64>,
    /// Inflate voxels up to this far from an occupied one, in metres
    #[arg(long, value_name = "M", default_value_t = 0.2)]
    pub radius: f64,
    /// Probability of a voxel before its first hit
    #[arg(long, value_name = "P", default_value_t = 0.5)]
    pub p_init: f64,
    /// Skip points nearer to the sensor than this, in metres
    #[arg(long, value_name = "M", default_value_t = 0.0)]
    pub min_range: f64,
    /// Edge of a voxel in metres
    #[arg(long, value_name = "M", default_value_t = 0.1)]
    pub resolution: f64,
    /// Take about so many points of each scan, evenly [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub points: Option<u32>,
    /// Run the scans so many times, and count for each update the least of its times: what others do on the machine
    /// adds to some, never to all
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repeat: u32,
    /// Picture of the map at several times
    #[arg(short = 'o', long = "output", value_name = "FILE", default_value = "local_map.png")]
    pub output: PathBuf,
    /// Print JSON, one object a setup
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub read: ReadArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PresetName {
    /// For a planner that reacts: near in space and time
    Local,
    /// For navigation that maps on its way: everything, inflated near the robot
    Autonomous,
    /// For a robot that listens to others: far input, all of it inflated
    Passive,
    /// The setups a to e of the paper
    Table,
}

#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// Shell that reads the script
    pub shell: Shell,
}

#[derive(Debug, Args)]
pub struct ManArgs {
    /// Folder of the pages; made if it is absent
    #[arg(short = 'o', long = "output", value_name = "FOLDER")]
    pub output: PathBuf,
}
