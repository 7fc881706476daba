use clap::{Args, ValueEnum};
use std::path::PathBuf;
use voxtile::operations::Prefer;

#[derive(Debug, Args)]
pub struct MergeArgs {
    /// Folders of the maps, two or more, of the same resolution and tile size; MAP@SNAPSHOT for a snapshot
    #[arg(value_name = "MAP", num_args = 2.., required = true)]
    pub maps: Vec<PathBuf>,
    /// Folder of the map to make; it is not there before all of it is
    #[arg(short = 'o', long = "output", value_name = "MAP")]
    pub output: PathBuf,
    /// Whose voxel to take where several maps have one [default: log-odds and counts are added, which takes maps of the
    /// model log-odds with equal parameters]
    #[arg(long, value_name = "WHICH")]
    pub prefer: Option<PreferName>,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum PreferName {
    /// That of the map named first
    First,
    /// That of the map named last
    Last,
    /// That with more observations; of as many, that of the map named first
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
    /// Folder of the map; MAP@SNAPSHOT for a snapshot of it
    pub map: PathBuf,
    #[command(flatten)]
    pub part: PartArgs,
    /// Folder of the map to make; it is not there before all of it is
    #[arg(short = 'o', long = "output", value_name = "MAP")]
    pub output: PathBuf,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct ClearArgs {
    /// Folder of the map
    pub map: PathBuf,
    #[command(flatten)]
    pub part: PartArgs,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct PartArgs {
    /// Voxels whose center is in this box: X0 <= x < X1 and so on, in metres
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6, required = true)]
    pub region: Vec<f64>,
    /// All other voxels instead
    #[arg(long)]
    pub outside: bool,
}

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct DecayArgs {
    /// Folder of the map
    pub map: PathBuf,
    /// After so many scans log-odds are half of what they were
    #[arg(long, value_name = "SCANS")]
    pub halflife: f64,
    /// For so many scans, whether they came or not [default: those since the last decay, or since the map's beginning]
    #[arg(long, value_name = "N")]
    pub scans: Option<u64>,
    /// Voxels whose log-odds are then nearer to 0 than this become unknown, 0.4 say [default: none do]
    #[arg(long, value_name = "L")]
    pub forget_below: Option<f64>,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
}
