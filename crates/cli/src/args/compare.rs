use super::help;
use bytesize::ByteSize;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct CompareArgs {
    /// Earlier map: a folder, FOLDER@SNAPSHOT, or an OctoMap file (.bt .ot)
    pub before: PathBuf,
    /// Later map of the same resolution
    pub after: PathBuf,
    /// Distance along each axis within which occupied voxels are the same surface, in metres: the error of the poses,
    /// rounded to voxels, at most 16 voxels [default: one voxel]
    #[arg(long, value_name = "M")]
    pub tolerance: Option<f64>,
    /// Number of connected voxels from which on a change is listed
    #[arg(long, value_name = "N", default_value_t = 8)]
    pub min_voxels: u64,
    /// Probability, above 0.5, with which one map must know a changed voxel as occupied and the other as free; with
    /// less the voxel is uncertain
    #[arg(long, value_name = "P", default_value_t = 0.7)]
    pub certainty: f64,
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6, help = help::VOXELS_IN_BOX)]
    pub region: Option<Vec<f64>>,
    /// Poses of the earlier map's sensor, in the map's frame: of what this map has not seen, the voxels that something
    /// was in front of count as hidden [default: poses of the scans that the map keeps]
    #[arg(long, value_name = "FILE")]
    pub poses_before: Option<PathBuf>,
    /// The same for the later map
    #[arg(long, value_name = "FILE")]
    pub poses_after: Option<PathBuf>,
    /// Also write the list of changes: .csv .json .geojson
    #[arg(long, value_name = "FILE")]
    pub list: Option<PathBuf>,
    /// Also write the voxels of the listed changes, with class (65 appeared, 66 vanished) and colour: .las .laz
    /// .copc.laz .ply .csv .parquet
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// With -o: all occupied voxels of both maps, also 64 unchanged, 67 not seen before, 68 not seen after, 69 and 70
    /// uncertain, 71 and 72 hidden
    #[arg(long, requires = "output")]
    pub all: bool,
    /// Also write a report as one HTML file: counts, a picture from above, and the largest changes with pictures
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Memory for tiles, such as 256MiB or 1GB; at least what one block needs
    #[arg(long, value_name = "SIZE", default_value = "256MiB")]
    pub memory: ByteSize,
    /// Print the result as JSON, including every change
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct CoverageArgs {
    #[arg(help = help::ANY_MAP)]
    pub map: PathBuf,
    /// Poses of the sensor, in the map's frame: occupied voxels are counted by the distance to the nearest position
    /// [default: poses of the scans that the map keeps]
    #[arg(long, value_name = "FILE")]
    pub poses: Option<PathBuf>,
    /// Number of connected voxels from which on a frontier is listed
    #[arg(long, value_name = "N", default_value_t = 8)]
    pub min_voxels: u64,
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6, help = help::VOXELS_IN_BOX)]
    pub region: Option<Vec<f64>>,
    /// Memory for tiles, such as 256MiB or 1GB; at least what one block needs
    #[arg(long, value_name = "SIZE", default_value = "256MiB")]
    pub memory: ByteSize,
    /// Print the result as JSON, including every frontier
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct VolumeArgs {
    /// Earlier map: a folder, FOLDER@SNAPSHOT, or an OctoMap file (.bt .ot). Its surface is the highest occupied voxel
    /// of each column
    pub map: PathBuf,
    /// Later map of the same resolution: fill is where its surface is higher, cut where it is lower
    pub after: Option<PathBuf>,
    /// Instead of a later map: fill is what the map has above this height in metres, cut what is missing below it
    #[arg(long, value_name = "Z", conflicts_with = "after")]
    pub plane: Option<f64>,
    /// Difference of heights from which on a column counts, in metres, rounded to voxels
    #[arg(long, value_name = "M", default_value_t = 0.0, conflicts_with = "plane")]
    pub least: f64,
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6, help = help::VOXELS_IN_BOX)]
    pub region: Option<Vec<f64>>,
    /// Only columns with their center in the polygons of a GeoJSON file, in the map's coordinates
    #[arg(long, value_name = "FILE")]
    pub polygon: Option<PathBuf>,
    /// Memory for tiles, such as 256MiB or 1GB; at least what one block of columns needs
    #[arg(long, value_name = "SIZE", default_value = "256MiB")]
    pub memory: ByteSize,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}
