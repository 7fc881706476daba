use super::help;
use bytesize::ByteSize;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use voxtile_distance::UnknownRule;

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct DistanceArgs {
    #[arg(help = help::ANY_MAP)]
    pub map: PathBuf,
    /// Folder of the distance field; an earlier one is updated by what changed in the map
    #[arg(short = 'o', long = "output", value_name = "FIELD", required_unless_present_any = ["npz", "png"])]
    pub output: Option<PathBuf>,
    /// Cap: larger distances are only known to be larger, in metres; at most 181 voxels
    #[arg(long, value_name = "M", default_value_t = 5.0)]
    pub max_distance: f64,
    /// Treatment of unknown voxels
    #[arg(long, value_name = "RULE", default_value = "unknown")]
    pub unknown: UnknownName,
    /// Make distances inside obstacles negative: to the nearest free voxel
    #[arg(long)]
    pub signed: bool,
    /// Compute only tiles that overlap a box (X0 <= x < X1, same for y and z), in metres; files have exactly this box
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6)]
    pub region: Option<Vec<f64>>,
    /// Memory for tiles and distances, such as 256MiB or 1GB; at least what one tile needs
    #[arg(long, value_name = "SIZE", default_value = "256MiB")]
    pub memory: ByteSize,
    /// Also write the distances of the box as NumPy arrays
    #[arg(long, value_name = "FILE")]
    pub npz: Option<PathBuf>,
    /// Also write a layer of the box as 16-bit grey PNG, in millimetres; 65534 is beyond the cap, 65535 unknown
    #[arg(long, value_name = "FILE", requires = "slice_z")]
    pub png: Option<PathBuf>,
    /// Height of the layer of --png, in metres
    #[arg(long, value_name = "Z", requires = "png")]
    pub slice_z: Option<f64>,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum UnknownName {
    /// Their distance is unknown, and they shorten no other
    Unknown,
    /// They are free
    Free,
    /// They are obstacles
    Obstacle,
}

impl From<UnknownName> for UnknownRule {
    fn from(name: UnknownName) -> Self {
        match name {
            UnknownName::Unknown => Self::Unknown,
            UnknownName::Free => Self::Free,
            UnknownName::Obstacle => Self::Obstacle,
        }
    }
}
