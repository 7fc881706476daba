use super::ColorName;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct PictureArgs {
    /// Folder of the map, FOLDER@SNAPSHOT, or an OctoMap file (.bt .ot)
    pub map: PathBuf,
    /// PNG to write; - is standard output
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    pub output: PathBuf,
    /// From where to look
    #[arg(long, value_name = "VIEW", default_value = "above")]
    pub from: ViewName,
    /// Draw from above only the layer at this height, in metres
    #[arg(long, value_name = "Z")]
    pub slice: Option<f64>,
    /// Thickness of that layer in metres [default: one voxel]
    #[arg(long, value_name = "M", requires = "slice")]
    pub thickness: Option<f64>,
    /// What the colors show
    #[arg(long, value_name = "WHAT", default_value = "height")]
    pub color: ColorName,
    /// Only voxels whose center is in this box: X0 <= x < X1 and so on, in metres
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6)]
    pub region: Option<Vec<f64>>,
    /// Most pixels along an edge of the map, 16 to 8192
    #[arg(long, value_name = "PIXELS", default_value = "2048", value_parser = clap::value_parser!(u16).range(16..=8192))]
    pub size: u16,
    /// Leave out the borders of tiles
    #[arg(long)]
    pub no_grid: bool,
    /// Leave out the way of the sensor
    #[arg(long)]
    pub no_path: bool,
    /// Draw what has changed since a snapshot of the map, or since another map: what appeared, vanished, stayed
    #[arg(long, value_name = "SNAPSHOT|MAP", conflicts_with = "color")]
    pub since: Option<PathBuf>,
    /// Print what was drawn as JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ViewName {
    /// From above: x to the right, y up
    Above,
    /// From a side: x to the right, z up
    SideX,
    /// From a side: y to the right, z up
    SideY,
}

#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Folder of the map, or FOLDER@SNAPSHOT
    pub map: PathBuf,
    /// Page to write; - is standard output
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    pub output: PathBuf,
    /// Do not check every file of the map for damage, which reads the whole map once more
    #[arg(long)]
    pub no_verify: bool,
    /// Print what was written as JSON
    #[arg(long)]
    pub json: bool,
}
