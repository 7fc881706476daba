#[cfg(feature = "bucket")]
mod bucket;
mod build;
mod edit;
mod export;
mod local;
mod picture;
mod read;
mod remap;
mod snapshot;
#[cfg(feature = "view")]
mod view;

#[cfg(feature = "bucket")]
pub use bucket::{PullArgs, PushArgs};
pub use build::{BuildArgs, InsertName, ModelName, OctreeArgs, OctreeName, StorageName, VoxelCacheName};
use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
pub use edit::{ClearArgs, CropArgs, DecayArgs, MergeArgs, PartArgs};
pub use export::{ExportArgs, WhatName};
pub use local::{LocalArgs, PresetName};
use log::LevelFilter;
pub use picture::{PictureArgs, ReportArgs, ViewName};
pub use read::{FrameName, ReadArgs};
pub use remap::{RemapArgs, RemovePointsArgs, RemoveScansArgs, ReworkArgs};
pub use snapshot::{DiffArgs, RevertArgs, SnapshotArgs, SnapshotsArgs};
use std::ffi::OsString;
use std::path::PathBuf;
#[cfg(feature = "bucket")]
use std::time::Duration;
#[cfg(feature = "view")]
pub use view::ViewArgs;

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
    /// Print nothing but errors, answers and JSON: no warnings, summaries or progress bars
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Fail a bucket request after this many seconds without progress (16 KiB transferred, or an answer); an upload
    /// after twice as many [default:
    /// VOXTILE_BUCKET_TIMEOUT, or 60]
    #[cfg(feature = "bucket")]
    #[arg(long, global = true, value_name = "SECONDS", value_parser = bucket::timeout_of)]
    pub bucket_timeout: Option<Duration>,
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
    /// Draw a map: from above, cut at a height, from a side, or what has changed; as PNG
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
    /// Make one map of several, without their snapshots and kept scans
    Merge(MergeArgs),
    /// Make a map of a part of another, without its snapshots and kept scans
    Crop(CropArgs),
    /// Make a part of a map unknown, in place
    Clear(ClearArgs),
    /// Let the evidence of a map fade by the scans that have come since, in place
    Decay(DecayArgs),
    /// Give the scans that a map keeps new poses, and map again what that touches, in place; or make another map of the
    /// same scans
    Remap(RemapArgs),
    /// Take scans out of a map that keeps them, as if they had never been, in place
    RemoveScans(RemoveScansArgs),
    /// Take all points in a box out of the scans that a map keeps, and map again what their rays touched, in place
    RemovePoints(RemovePointsArgs),
    /// Write a map anew with another storage: small, or as other programs read it; the content stays, to the bit, and
    /// snapshots and kept scans are not taken along
    Convert(ConvertArgs),
    /// Copy a map into a bucket of an object store; only what has changed since the last push is sent
    #[cfg(feature = "bucket")]
    Push(PushArgs),
    /// Not in this build
    #[cfg(not(feature = "bucket"))]
    #[command(hide = true, disable_help_flag = true)]
    Push(LeftOutArgs),
    /// Make a map in a folder of one in a bucket
    #[cfg(feature = "bucket")]
    Pull(PullArgs),
    /// Not in this build
    #[cfg(not(feature = "bucket"))]
    #[command(hide = true, disable_help_flag = true)]
    Pull(LeftOutArgs),
    /// Check every file of a map for damage; exit code 1 if there is any
    Verify(VerifyArgs),
    /// Do what is possible for a damaged map; what cannot stay goes to quarantine/, nothing is deleted; exit code 1 if
    /// there is such a thing
    Repair(RepairArgs),
    /// Look at maps in a browser: a server on this machine, and a page that needs no network
    #[cfg(feature = "view")]
    View(ViewArgs),
    /// Not in this build
    #[cfg(not(feature = "view"))]
    #[command(hide = true, disable_help_flag = true)]
    View(LeftOutArgs),
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
            Self::Remap(args) => args.rework.json,
            Self::RemoveScans(args) => args.rework.json,
            Self::RemovePoints(args) => args.rework.json,
            #[cfg(feature = "bucket")]
            Self::Push(args) => args.json,
            #[cfg(feature = "bucket")]
            Self::Pull(args) => args.json,
            #[cfg(not(feature = "bucket"))]
            Self::Push(args) | Self::Pull(args) => args.is_json(),
            Self::Verify(args) => args.json,
            Self::Repair(args) => args.json,
            #[cfg(feature = "view")]
            Self::View(args) => args.json,
            #[cfg(not(feature = "view"))]
            Self::View(args) => args.is_json(),
            Self::Local(args) => args.json,
            Self::Demo(args) => args.json,
            // What voxtile-share is asked for is its own to say.
            Self::Share(_) | Self::Completions(_) | Self::Man(_) => false,
        }
    }
}

/// Arguments of a subcommand that this build leaves out.
#[cfg(not(all(feature = "bucket", feature = "view")))]
#[derive(Debug, Args)]
pub struct LeftOutArgs {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

#[cfg(not(all(feature = "bucket", feature = "view")))]
impl LeftOutArgs {
    fn is_json(&self) -> bool {
        self.arguments.iter().any(|argument| argument == "--json")
    }
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
    /// A file of points, one a line: x y z in metres, separated by blanks, commas, semicolons or tabs; - for standard
    /// input
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
