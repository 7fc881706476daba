#[cfg(feature = "bucket")]
mod bucket;
mod build;
mod clean;
mod compare;
mod distance;
mod edit;
mod export;
mod help;
mod local;
mod max_height;
mod picture;
mod read;
mod remap;
mod snapshot;
#[cfg(feature = "view")]
mod view;

#[cfg(feature = "bucket")]
pub use bucket::{PullArgs, PushArgs};
pub use build::{
    BuildArgs, ClearingName, InsertName, ModelName, OctreeArgs, OctreeName, StorageName, VoxelCacheName,
};
use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
pub use clean::CleanArgs;
pub use compare::{CompareArgs, CoverageArgs, VolumeArgs};
pub use distance::DistanceArgs;
pub use edit::{ClearArgs, CropArgs, DecayArgs, MergeArgs};
pub use export::{ExportArgs, WhatName};
pub use local::{LocalArgs, PresetName};
use log::LevelFilter;
pub use max_height::MaxHeight;
pub use picture::{BackgroundName, PictureArgs, ReportArgs, ViewName};
pub use read::{FrameName, ReadArgs, ReturnsName};
pub use remap::{RemapArgs, RemovePointsArgs, RemoveScansArgs, ReplayArgs};
pub use snapshot::{DiffArgs, RevertArgs, SnapshotArgs, SnapshotsArgs};
use std::ffi::OsString;
use std::path::PathBuf;
#[cfg(feature = "bucket")]
use std::time::Duration;
#[cfg(feature = "view")]
pub use view::ViewArgs;

/// Probabilistic 3D occupancy mapping for maps larger than memory.
///
/// Lengths are in metres, coordinates in the world frame.
#[derive(Debug, Parser)]
#[command(name = "voxtile", version, propagate_version = true, max_term_width = 80)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
    /// Maximum number of worker threads; the result is the same for any number [default: one per core]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Log flushes and other steps; -vv also logs each tile read or written. RUST_LOG sets the level by module
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub verbose: u8,
    /// Format of the log and of errors on standard error
    #[arg(long, global = true, value_enum, default_value_t = LogFormatName::Text, value_name = "FORMAT")]
    pub log_format: LogFormatName,
    /// Print only errors, results and JSON: no warnings, summaries or progress bars
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Fail a bucket request after this many seconds without progress (16 KiB transferred or a response), an upload
    /// after twice as many [default: VOXTILE_BUCKET_TIMEOUT, or 60]
    #[cfg(feature = "bucket")]
    #[arg(long, global = true, value_name = "SECONDS", value_parser = bucket::timeout_of)]
    pub bucket_timeout: Option<Duration>,
}

impl Cli {
    /// Log level from `--quiet` and `--verbose`; warnings by default.
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
    /// Build a map from scans, or add scans to a map
    Build(BuildArgs),
    /// List the scans of an input or of a map
    Scans(ScansArgs),
    /// Create a map from an OctoMap file (.bt .ot)
    Import(ImportArgs),
    /// Print the properties of a map: grid, extent, inputs, sizes
    Info(InfoArgs),
    /// Print whether points are occupied, free or unknown
    Query(QueryArgs),
    /// Find the first occupied voxel on a ray
    Raycast(RaycastArgs),
    /// Export voxels, their surface or the octree of a map to a file for other programs
    Export(ExportArgs),
    /// Compute the distances of voxels to the nearest obstacle, for planners
    Distance(DistanceArgs),
    /// Draw a map as PNG: from above, as a slice, from a side, or its changes
    Picture(PictureArgs),
    /// Write a report on a map with pictures, statistics and damage, as one HTML file
    Report(ReportArgs),
    /// Print the digest of a map's content; equal maps have equal digests
    Digest(DigestArgs),
    /// Create a snapshot of a map without copying its data, or delete one
    Snapshot(SnapshotArgs),
    /// List a map's snapshots
    Snapshots(SnapshotsArgs),
    /// Count the voxels that differ between two maps, or two snapshots of a map
    Diff(DiffArgs),
    /// List the things that vanished or appeared between two maps, and what only one of them has seen
    Compare(CompareArgs),
    /// List the frontiers of a map: free voxels next to unknown ones
    Coverage(CoverageArgs),
    /// Compute the volume that was filled and cut between two maps, or over a plane
    Volume(VolumeArgs),
    /// Restore a map to a snapshot, in place
    Revert(RevertArgs),
    /// Merge several maps into a new one, without their snapshots and kept scans
    Merge(MergeArgs),
    /// Copy a part of a map to a new map, without its snapshots and kept scans
    Crop(CropArgs),
    /// Make a part of a map unknown, in place
    Clear(ClearArgs),
    /// Decay the log-odds of all voxels by the number of scans since the last decay, in place
    Decay(DecayArgs),
    /// Apply new poses to the scans that a map keeps, in place, or build another map from these scans
    Remap(RemapArgs),
    /// Remove scans from a map that keeps its scans, as if they had never been added, in place
    RemoveScans(RemoveScansArgs),
    /// Remove all points in a box from the scans that a map keeps and rebuild the affected tiles, in place
    RemovePoints(RemovePointsArgs),
    /// Mark what moved in the scans that a map keeps, such as cars and walkers, and rebuild the map without it, in place
    Clean(CleanArgs),
    /// Copy a map to a new map with another storage format and the same content, without its snapshots and kept scans
    Convert(ConvertArgs),
    /// Upload a map to a bucket of an object store; sends only changes since the last push
    #[cfg(feature = "bucket")]
    Push(PushArgs),
    /// Not in this build
    #[cfg(not(feature = "bucket"))]
    #[command(hide = true, disable_help_flag = true)]
    Push(LeftOutArgs),
    /// Download a map from a bucket to a folder
    #[cfg(feature = "bucket")]
    Pull(PullArgs),
    /// Not in this build
    #[cfg(not(feature = "bucket"))]
    #[command(hide = true, disable_help_flag = true)]
    Pull(LeftOutArgs),
    /// Check every file of a map for damage; exit code 1 if any is damaged
    Verify(VerifyArgs),
    /// Repair a damaged map; unrecoverable files move to quarantine/; exit code 1 if data is lost or still damaged
    Repair(RepairArgs),
    /// Show maps in a browser with a local server; needs no network
    #[cfg(feature = "view")]
    View(ViewArgs),
    /// Not in this build
    #[cfg(not(feature = "view"))]
    #[command(hide = true, disable_help_flag = true)]
    View(LeftOutArgs),
    /// Run scans through a local map for planning; prints sizes and times, and draws a picture
    Local(LocalArgs),
    /// Share occupied space with other robots over a network; runs voxtile-share, which is installed separately
    #[command(disable_help_flag = true)]
    Share(ShareArgs),
    /// Map a small synthetic city and draw it; needs no data
    Demo(DemoArgs),
    /// Print a completion script for a shell
    Completions(CompletionsArgs),
    /// Write the man pages to a folder
    Man(ManArgs),
}

impl Command {
    /// Returns whether `--json` is set.
    pub fn is_json(&self) -> bool {
        match self {
            Self::Build(args) => args.json,
            Self::Scans(args) => args.json,
            Self::Import(args) => args.json,
            Self::Info(args) => args.json,
            Self::Query(args) => args.json,
            Self::Raycast(args) => args.json,
            Self::Export(args) => args.json,
            Self::Distance(args) => args.json,
            Self::Picture(args) => args.json,
            Self::Report(args) => args.json,
            Self::Digest(args) => args.json,
            Self::Snapshot(args) => args.json,
            Self::Snapshots(args) => args.json,
            Self::Diff(args) => args.json,
            Self::Compare(args) => args.json,
            Self::Coverage(args) => args.json,
            Self::Volume(args) => args.json,
            Self::Revert(args) => args.json,
            Self::Merge(args) => args.json,
            Self::Crop(args) => args.json,
            Self::Clear(args) => args.json,
            Self::Decay(args) => args.json,
            Self::Convert(args) => args.json,
            Self::Remap(args) => args.replay.json,
            Self::RemoveScans(args) => args.replay.json,
            Self::RemovePoints(args) => args.replay.json,
            Self::Clean(args) => args.replay.json,
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
            // voxtile-share parses its own arguments.
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
pub enum LogFormatName {
    /// Lines of text
    Text,
    /// A JSON object per line: time (UTC), level, target, message
    Json,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum ColorName {
    /// Height of the topmost occupied voxel
    Height,
    /// Highest probability in the column
    Probability,
    /// Highest observation count of a voxel in the column
    Count,
    /// Number of the last scan in the tile's latest flush
    LastScan,
    /// Mean color of the points in the topmost occupied voxel; needs the layer colour
    Rgb,
    /// Their mean intensity, from the 2nd to the 98th percentile; needs the layer intensity
    Intensity,
    /// Their most frequent class, by the names of LAS; needs the layer class
    Class,
    /// Time of the last scan that hit the topmost occupied voxel; needs the layer time
    Age,
}

#[derive(Debug, Args)]
pub struct ShareArgs {
    /// Arguments of voxtile-share; --help lists them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    pub arguments: Vec<OsString>,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct ScansArgs {
    /// Inputs of scans as in build, a map, or MAP@SNAPSHOT
    #[arg(value_name = "DATA", required = true)]
    pub data: Vec<PathBuf>,
    /// List each scan: number, time stamp in seconds, origin in metres, points, name
    #[arg(long)]
    pub each: bool,
    /// Print the result as JSON; with --each, one object per scan and then the summary
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub read: ReadArgs,
}

#[derive(Debug, Args)]
pub struct ImportArgs {
    /// OctoMap file: .bt with free and occupied voxels, or .ot with log-odds
    pub file: PathBuf,
    #[arg(short = 'o', long = "output", value_name = "MAP", help = help::NEW_MAP)]
    pub output: PathBuf,
    #[arg(long, value_name = "FORM", default_value = "octomap", help = help::STORAGE)]
    pub storage: StorageName,
    /// Refuse a file that expands to more voxels than this; a few bytes can represent up to 2^48
    #[arg(long, value_name = "N", default_value_t = 1 << 32)]
    pub max_voxels: u64,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct InfoArgs {
    #[arg(help = help::ANY_MAP)]
    pub map: PathBuf,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct QueryArgs {
    #[arg(help = help::ANY_MAP)]
    pub map: PathBuf,
    /// Point to query: X Y Z in metres
    #[arg(value_names = ["X", "Y", "Z"], num_args = 3, required_unless_present = "points")]
    pub point: Vec<f64>,
    /// File of points to query, one x y z per line in metres, separated by blanks, commas, semicolons or tabs; - is
    /// standard input
    #[arg(long, value_name = "FILE", conflicts_with = "point")]
    pub points: Option<PathBuf>,
    /// Print the result as JSON, one object per line
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct RaycastArgs {
    #[arg(help = help::ANY_MAP)]
    pub map: PathBuf,
    /// Start of the ray, in metres
    #[arg(long, value_names = ["X", "Y", "Z"], num_args = 3, required = true)]
    pub origin: Vec<f64>,
    /// Direction of the ray; any length except 0
    #[arg(long, value_names = ["X", "Y", "Z"], num_args = 3, required = true)]
    pub direction: Vec<f64>,
    /// Maximum length of the ray, in metres [default: to the boundary of the map]
    #[arg(long, value_name = "M")]
    pub max_range: Option<f64>,
    /// Stop the ray at unknown space
    #[arg(long)]
    pub unknown_blocks: bool,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct DigestArgs {
    #[arg(help = help::ANY_MAP)]
    pub map: PathBuf,
    /// Print the digest of the layers instead of that of the evidence
    #[arg(long)]
    pub layers: bool,
    /// Print the digest of the kept scans instead, in their order
    #[arg(long, conflicts_with = "layers")]
    pub scans: bool,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// Folder of the map; its snapshots are checked too. Another process may be writing to it
    pub map: PathBuf,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct ConvertArgs {
    #[arg(help = help::MAP_OR_SNAPSHOT)]
    pub map: PathBuf,
    #[arg(short = 'o', long = "output", value_name = "MAP", help = help::NEW_MAP)]
    pub output: PathBuf,
    #[arg(long, value_name = "FORM", help = help::STORAGE)]
    pub storage: StorageName,
    /// Do not copy the scans that the map keeps: the new map is smaller, but cannot be remapped
    #[arg(long)]
    pub drop_scans: bool,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct RepairArgs {
    #[arg(help = help::MAP)]
    pub map: PathBuf,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct DemoArgs {
    /// Folder for the map and the picture
    #[arg(long, value_name = "DIR", default_value = "voxtile_demo")]
    pub out: PathBuf,
    /// Random seed of the city
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Length of the drive, in metres; one scan every two metres
    #[arg(long, value_name = "M", default_value_t = 400)]
    pub length: u32,
    #[arg(long, value_name = "M", default_value_t = 0.2, help = help::RESOLUTION)]
    pub resolution: f64,
    #[arg(long, value_name = "FORM", default_value = "octomap", help = help::STORAGE)]
    pub storage: StorageName,
    #[arg(long, value_name = "WHAT", default_value = "height", help = help::COLOR)]
    pub color: ColorName,
    /// Maximum number of tiles in memory
    #[arg(long, value_name = "N", default_value_t = 24)]
    pub cache_tiles: usize,
    #[arg(long, help = help::JSON)]
    pub json: bool,
    #[command(flatten)]
    pub octree: OctreeArgs,
}

#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// Shell of the script
    pub shell: Shell,
}

#[derive(Debug, Args)]
pub struct ManArgs {
    /// Folder of the pages; created if missing
    #[arg(short = 'o', long = "output", value_name = "FOLDER")]
    pub output: PathBuf,
}
