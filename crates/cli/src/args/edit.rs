use super::help;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::time::Duration;
use voxtile::operations::Prefer;

#[derive(Debug, Args)]
pub struct MergeArgs {
    /// Folders of two or more maps with equal resolution and tile size, or MAP@SNAPSHOT
    #[arg(value_name = "MAP", num_args = 2.., required = true)]
    pub maps: Vec<PathBuf>,
    #[arg(short = 'o', long = "output", value_name = "MAP", help = help::NEW_MAP)]
    pub output: PathBuf,
    /// Voxel to keep where several maps have one [default: add log-odds and counts; needs the log-odds model with equal
    /// parameters]
    #[arg(long, value_name = "WHICH")]
    pub prefer: Option<PreferName>,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum PreferName {
    /// From the first map named
    First,
    /// From the last map named
    Last,
    /// With the most observations; if equal, from the first map named
    MoreObserved,
}

impl From<PreferName> for Prefer {
    fn from(name: PreferName) -> Self {
        match name {
            PreferName::First => Self::First,
            PreferName::Last => Self::Last,
            PreferName::MoreObserved => Self::MoreObserved,
        }
    }
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct CropArgs {
    #[arg(help = help::MAP_OR_SNAPSHOT)]
    pub map: PathBuf,
    /// Box of voxels by their centers (X0 <= x < X1, same for y and z), in metres
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6,
        required_unless_present = "polygon")]
    pub region: Option<Vec<f64>>,
    /// Voxels with their center in the polygons of a GeoJSON file, in the map's coordinates: even-odd in each polygon
    /// with its holes; of the edges, the lower and left ones are included
    #[arg(long, value_name = "FILE", conflicts_with = "region")]
    pub polygon: Option<PathBuf>,
    /// With --polygon: range of heights of the centers (MIN <= z < MAX), in metres; -inf and inf are allowed [default:
    /// all]
    #[arg(long, value_names = ["MIN", "MAX"], num_args = 2, allow_hyphen_values = true, requires = "polygon")]
    pub z: Option<Vec<f64>>,
    /// Select all other voxels instead
    #[arg(long)]
    pub outside: bool,
    /// Keep the kept scans that reach the part too, with all their points. A remap maps them into whole tiles, so it
    /// restores the voxels of the outer tiles
    #[arg(long, conflicts_with = "outside")]
    pub keep_scans: bool,
    #[arg(short = 'o', long = "output", value_name = "MAP", help = help::NEW_MAP)]
    pub output: PathBuf,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct ClearArgs {
    #[arg(help = help::MAP)]
    pub map: PathBuf,
    #[command(flatten)]
    pub part: PartArgs,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct PartArgs {
    /// Box of voxels by their centers (X0 <= x < X1, same for y and z), in metres
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6, required = true)]
    pub region: Vec<f64>,
    /// Select all voxels outside the box instead
    #[arg(long)]
    pub outside: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct DecayArgs {
    #[arg(help = help::MAP)]
    pub map: PathBuf,
    /// Number of scans after which log-odds are halved
    #[arg(long, value_name = "SCANS", required_unless_present = "older_than")]
    pub halflife: Option<f64>,
    /// Instead: make occupied voxels unknown that no scan has hit for so long, such as 7d or 12h; free ones stay. The
    /// map needs the layer time
    #[arg(long, value_name = "TIME", value_parser = humantime::parse_duration,
        conflicts_with_all = ["halflife", "scans", "forget_below"])]
    pub older_than: Option<Duration>,
    /// With --older-than: time from which ages count, in seconds since the epoch of the stamps [default: the last hit]
    #[arg(long, value_name = "S", requires = "older_than", allow_negative_numbers = true)]
    pub now: Option<f64>,
    /// Decay as if N scans had passed [default: scans since the last decay, or since the map was created]
    #[arg(long, value_name = "N")]
    pub scans: Option<u64>,
    /// Make voxels unknown whose decayed log-odds are nearer to 0 than this, for example 0.4 [default: none]
    #[arg(long, value_name = "L")]
    pub forget_below: Option<f64>,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}
