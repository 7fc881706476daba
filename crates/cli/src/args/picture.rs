use super::{ColorName, MaxHeight, help};
use clap::builder::{PossibleValue, PossibleValuesParser};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use voxtile_render::ColorMap;

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct PictureArgs {
    #[arg(help = help::ANY_MAP)]
    pub map: PathBuf,
    /// PNG file to write; - is standard output
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    pub output: PathBuf,
    /// Viewing direction
    #[arg(long, value_name = "VIEW", default_value = "above")]
    pub from: ViewName,
    /// With --from oblique: direction from the map to the viewer, counterclockwise from x, in degrees [default: -60]
    #[arg(long, value_name = "DEGREES")]
    pub azimuth: Option<f64>,
    /// With --from oblique: angle of the viewer above the horizon, 0 to 90 degrees [default: 40]
    #[arg(long, value_name = "DEGREES")]
    pub elevation: Option<f64>,
    /// Draw only the layer at this height from above, in metres
    #[arg(long, value_name = "Z")]
    pub slice: Option<f64>,
    /// Thickness of the layer, in metres [default: one voxel]
    #[arg(long, value_name = "M", requires = "slice")]
    pub thickness: Option<f64>,
    /// Draw the distances of the layer at this height to the nearest obstacle, in metres
    #[arg(long, value_name = "Z", conflicts_with_all = ["slice", "color", "since"])]
    pub distance_slice: Option<f64>,
    /// Cap of the distances, in metres
    #[arg(long, value_name = "M", default_value_t = 5.0, requires = "distance_slice")]
    pub max_distance: f64,
    #[arg(long, value_name = "WHAT", default_value = "height", help = help::COLOR)]
    pub color: ColorName,
    /// Colors of the values [default: voxtile]
    #[arg(long, value_name = "NAME", value_parser = color_map_names(), conflicts_with = "since")]
    pub color_map: Option<String>,
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6, help = help::VOXELS_IN_BOX)]
    pub region: Option<Vec<f64>>,
    #[arg(long, value_name = "Z|none", default_value = "auto", allow_hyphen_values = true, help = help::MAX_HEIGHT)]
    pub max_height: MaxHeight,
    /// Maximum length of the map's longer edge, in pixels, 16 to 16384
    #[arg(long, value_name = "PIXELS", default_value = "2048", value_parser = clap::value_parser!(u16).range(16..=16384))]
    pub size: u16,
    /// Resolution in pixels per inch, 10 to 2400: type and lines have the size of print [default: that of a picture 17
    /// cm wide]
    #[arg(long, value_name = "DPI", value_parser = clap::value_parser!(u16).range(10..=2_400))]
    pub dpi: Option<u16>,
    #[arg(long, value_name = "COLOR", default_value = "dark", help = "Color of unknown space and margins")]
    pub background: BackgroundName,
    /// Draw no borders of tiles; in the oblique view, no ground grid
    #[arg(long)]
    pub no_grid: bool,
    /// Draw no trajectory
    #[arg(long)]
    pub no_path: bool,
    /// Draw the changes since a snapshot of the map or since another map: appeared, vanished, unchanged
    #[arg(long, value_name = "SNAPSHOT|MAP", conflicts_with = "color")]
    pub since: Option<PathBuf>,
    /// Also draw the points of kept scans that clean has marked as moving, in red with a light rim
    #[arg(long)]
    pub moving: bool,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

/// Names and purposes of all color maps.
fn color_map_names() -> PossibleValuesParser {
    ColorMap::all().iter().map(|map| PossibleValue::new(map.name).help(map.purpose)).into()
}

impl PictureArgs {
    pub fn azimuth_deg(&self) -> f64 {
        self.azimuth.unwrap_or(-60.0)
    }

    pub fn elevation_deg(&self) -> f64 {
        self.elevation.unwrap_or(40.0)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ViewName {
    /// From above: x to the right, y up
    Above,
    /// From a side: x to the right, z up
    SideX,
    /// From a side: y to the right, z up
    SideY,
    /// From --azimuth and --elevation: occupied voxels as shaded cubes
    Oblique,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BackgroundName {
    /// Nearly black, for screens
    Dark,
    /// Black, for screens
    Black,
    /// White, for print
    White,
    /// No background; dark type, as on white
    Transparent,
}

#[derive(Debug, Args)]
pub struct ReportArgs {
    #[arg(help = help::MAP_OR_SNAPSHOT)]
    pub map: PathBuf,
    /// HTML file to write; - is standard output
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    pub output: PathBuf,
    /// Colors of heights [default: voxtile]
    #[arg(long, value_name = "NAME", value_parser = color_map_names())]
    pub color_map: Option<String>,
    #[arg(long, value_name = "Z|none", default_value = "auto", allow_hyphen_values = true, help = help::MAX_HEIGHT)]
    pub max_height: MaxHeight,
    /// Skip the check of every file for damage, which reads the whole map once more
    #[arg(long)]
    pub no_verify: bool,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}
