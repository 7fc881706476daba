use super::{ClearingName, InsertName, ModelName, StorageName, help};
use bytesize::ByteSize;
use clap::Args;
use std::path::PathBuf;
use voxtile::Layers;
use voxtile::store::SnapshotName;
use voxtile_pipeline::WhichScans;

/// Options of all commands that replay kept scans.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    #[arg(long, value_name = "NAME", help = help::KEEP_AS)]
    pub keep_as: Option<SnapshotName>,
    /// Print the changes and the expected time without changing the map
    #[arg(long)]
    pub dry_run: bool,
    #[arg(long, value_name = "SIZE", help = help::MEMORY)]
    pub memory: Option<ByteSize>,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

fn which_scans(text: &str) -> Result<WhichScans, String> {
    match text.parse() {
        _ if text == "stamps" => Ok(WhichScans::Stamped),
        Ok(0) | Err(_) => Err("a number of scans from 1 is needed".to_owned()),
        Ok(step) => Ok(WhichScans::Every(step)),
    }
}

#[derive(Debug, Args)]
#[command(
    allow_negative_numbers = true,
    override_usage = "voxtile remap [OPTIONS] <MAP> --poses <FILE>\n       voxtile remap [OPTIONS] <MAP> [--poses <FILE>] -o \
                      <MAP2>"
)]
pub struct RemapArgs {
    #[arg(help = help::MAP_WITH_SCANS)]
    pub map: PathBuf,
    /// New poses, sensor to world, in a format of build --poses; one per scan in order, or by time stamp
    #[arg(long, value_name = "FILE", required_unless_present = "output")]
    pub poses: Option<PathBuf>,
    #[arg(long, value_name = "FILE", requires = "poses", help = help::CALIB)]
    pub calib: Option<PathBuf>,
    #[arg(
        long,
        value_name = "N",
        num_args = 7..=12,
        allow_hyphen_values = true,
        requires = "poses",
        help = help::EXTRINSIC
    )]
    pub extrinsic: Option<Vec<f64>>,
    #[arg(long, value_name = "S", default_value_t = 0.5, help = help::POSE_TOLERANCE)]
    pub pose_tolerance: f64,
    /// The file has the poses of some scans: those with a pose within a millisecond of their time stamp, or every N-th
    /// from the first on. The others keep their motion relative to the two around them
    #[arg(long, value_name = "N", requires = "poses", num_args = 0..=1, require_equals = true,
        default_missing_value = "stamps", value_parser = which_scans)]
    pub interpolate: Option<WhichScans>,
    /// Ignore moves and turns up to this size, such as 0.02m,0.1deg
    #[arg(long, value_name = "METRES,DEGREES", requires = "poses", conflicts_with = "output")]
    pub tolerance: Option<String>,
    /// Build another map from the same scans, with new poses or other parameters, instead of changing this one
    #[arg(short = 'o', long = "output", value_name = "MAP2")]
    pub output: Option<PathBuf>,
    /// With -o: edge length of a voxel, in metres [default: the map's]
    #[arg(long, value_name = "M", requires = "output")]
    pub resolution: Option<f64>,
    /// With -o: edge length of a tile, in metres [default: the map's; as of `voxtile build` if that does not fit the
    /// resolution]
    #[arg(long, value_name = "M", requires = "output")]
    pub tile_size: Option<f64>,
    /// With -o: skip points nearer to the sensor than this, in metres [default: as each scan was mapped]
    #[arg(long, value_name = "M", requires = "output")]
    pub min_range: Option<f64>,
    /// With -o: cut rays at this range, in metres [default: as each scan was mapped]
    #[arg(long, value_name = "M", requires = "output")]
    pub max_range: Option<f64>,
    /// With -o: number of updates of a voxel per scan [default: as each scan was mapped]
    #[arg(long, value_name = "MODE", requires = "output")]
    pub insert: Option<InsertName>,
    /// With -o: rule that selects which misses of a scan clear known voxels [default: the map's]
    #[arg(long, value_name = "RULE", requires = "output")]
    pub clearing: Option<ClearingName>,
    /// With -o: sensor model that turns observations into log-odds [default: the map's]
    #[arg(long, value_name = "MODEL", requires = "output")]
    pub sensor_model: Option<ModelName>,
    /// With -o: storage format of the tiles of the new map [default: the map's]
    #[arg(long, value_name = "FORM", requires = "output")]
    pub storage: Option<StorageName>,
    /// With -o: layers of the new map, as of build, as far as the kept scans hold what they need; none for no layers
    /// [default: the map's]
    #[arg(long, value_name = "LIST", requires = "output")]
    pub layers: Option<Layers>,
    /// With -o: keep the scans in the new map, too
    #[arg(long, requires = "output")]
    pub keep_scans: bool,
    #[command(flatten)]
    pub replay: ReplayArgs,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
#[group(id = "which", required = true, multiple = false, args = ["scans", "time", "input"])]
pub struct RemoveScansArgs {
    #[arg(help = help::MAP_WITH_SCANS)]
    pub map: PathBuf,
    /// Scans by number in the map: A..B, both included, or one number
    #[arg(long, value_name = "A..B")]
    pub scans: Option<String>,
    /// Scans between two time stamps, in seconds
    #[arg(long, value_names = ["T0", "T1"], num_args = 2)]
    pub time: Option<Vec<String>>,
    /// All scans of an input, by its name in the map (see info)
    #[arg(long, value_name = "NAME")]
    pub input: Option<String>,
    /// Also delete the snapshots that hold any of these scans
    #[arg(long)]
    pub from_snapshots: bool,
    #[command(flatten)]
    pub replay: ReplayArgs,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct RemovePointsArgs {
    #[arg(help = help::MAP_WITH_SCANS)]
    pub map: PathBuf,
    /// Box of the points to remove (X0 <= x < X1, same for y and z), in metres, world frame
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6, required = true)]
    pub region: Vec<f64>,
    #[command(flatten)]
    pub replay: ReplayArgs,
}
