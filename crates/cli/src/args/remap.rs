use super::{InsertName, ModelName, StorageName};
use bytesize::ByteSize;
use clap::Args;
use std::path::PathBuf;
use voxtile::store::SnapshotName;

/// What every command has that maps a part of a map again.
#[derive(Debug, Args)]
pub struct ReworkArgs {
    /// Keep the map as it is now as a snapshot of this name
    #[arg(long, value_name = "NAME")]
    pub keep_as: Option<SnapshotName>,
    /// Say what would be done and about how long it takes; do nothing
    #[arg(long)]
    pub dry_run: bool,
    /// Most memory for all that grows with the map or with a scan (256MiB, 1GB) [default: 512MiB, or what tiles of this
    /// size need at least]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<ByteSize>,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    override_usage = "voxtile remap [OPTIONS] <MAP> --poses <FILE>\n       voxtile remap [OPTIONS] <MAP> -o <MAP2>"
)]
pub struct RemapArgs {
    /// Folder of a map that keeps its scans (build --keep-scans)
    pub map: PathBuf,
    /// New poses, sensor to world: TUM, KITTI, CSV or .npy, as build reads them. One a scan in order, or by time stamps
    #[arg(long, value_name = "FILE", required_unless_present = "output", conflicts_with = "output")]
    pub poses: Option<PathBuf>,
    /// The calib.txt of a KITTI sequence, whose poses are of the camera
    #[arg(long, value_name = "FILE", requires = "poses")]
    pub calib: Option<PathBuf>,
    /// Where the sensor is in the body that the poses are of: tx ty tz qx qy qz qw, or 12 numbers of a 3x4 matrix
    #[arg(long, value_name = "N", num_args = 7..=12, allow_hyphen_values = true, requires = "poses")]
    pub extrinsic: Option<Vec<f64>>,
    /// Most seconds from a scan to the nearer of the poses around it; gaps of up to twice as long are filled
    #[arg(long, value_name = "S", default_value_t = 0.5)]
    pub pose_tolerance: f64,
    /// Leave scans alone that move and turn by no more than this, such as 0.02m,0.1deg
    #[arg(long, value_name = "METRES,DEGREES", requires = "poses")]
    pub tolerance: Option<String>,
    /// Make another map of the same scans with other parameters, in place of changing this one
    #[arg(short = 'o', long = "output", value_name = "MAP2")]
    pub output: Option<PathBuf>,
    /// -o: edge of a voxel in metres [default: the map's]
    #[arg(long, value_name = "M", requires = "output")]
    pub resolution: Option<f64>,
    /// -o: edge of a tile in metres [default: the map's]
    #[arg(long, value_name = "M", requires = "output")]
    pub tile_size: Option<f64>,
    /// -o: skip points nearer to the sensor than this, in metres [default: as each scan was mapped]
    #[arg(long, value_name = "M", requires = "output")]
    pub min_range: Option<f64>,
    /// -o: cut rays at this range in metres [default: as each scan was mapped]
    #[arg(long, value_name = "M", requires = "output")]
    pub max_range: Option<f64>,
    /// -o: how often one scan updates a voxel [default: as each scan was mapped]
    #[arg(long, value_name = "MODE", requires = "output")]
    pub insert: Option<InsertName>,
    /// -o: how observations become evidence [default: the map's]
    #[arg(long, value_name = "MODEL", requires = "output")]
    pub sensor_model: Option<ModelName>,
    /// -o: how the tiles are stored [default: the map's]
    #[arg(long, value_name = "FORM", requires = "output")]
    pub storage: Option<StorageName>,
    /// -o: keep the scans in the new map, too
    #[arg(long, requires = "output")]
    pub keep_scans: bool,
    #[command(flatten)]
    pub rework: ReworkArgs,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
#[group(id = "which", required = true, multiple = false, args = ["scans", "time", "input"])]
pub struct RemoveScansArgs {
    /// Folder of a map that keeps its scans (build --keep-scans)
    pub map: PathBuf,
    /// Scans by their numbers in the map: A..B, both included, or one number
    #[arg(long, value_name = "A..B")]
    pub scans: Option<String>,
    /// Scans from one time stamp to another, in seconds
    #[arg(long, value_names = ["T0", "T1"], num_args = 2)]
    pub time: Option<Vec<String>>,
    /// All scans of an input, as the map names it (info lists them)
    #[arg(long, value_name = "NAME")]
    pub input: Option<String>,
    /// Delete the snapshots that hold any of these scans, too
    #[arg(long)]
    pub from_snapshots: bool,
    #[command(flatten)]
    pub rework: ReworkArgs,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct RemovePointsArgs {
    /// Folder of a map that keeps its scans (build --keep-scans)
    pub map: PathBuf,
    /// Points in this box go: X0 <= x < X1 and so on, in metres, world frame
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6, required = true)]
    pub region: Vec<f64>,
    #[command(flatten)]
    pub rework: ReworkArgs,
}
