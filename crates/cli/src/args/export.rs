use super::help;
use bytesize::ByteSize;
use clap::builder::{ArgPredicate, PossibleValue, PossibleValuesParser};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use voxtile_formats::write::{FileUnit, OutputFormats};

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct ExportArgs {
    #[arg(help = help::ANY_MAP)]
    pub map: PathBuf,
    /// File to write. The extension selects the format: .ply .pcd .csv .xyz .npz .las .laz .copc.laz .e57 .parquet
    /// .mcap voxels, .glb their surface, .pgm a 2D occupancy grid for nav2, .png .tif heights, .bt .ot the octree. - is
    /// standard output (.ply .pcd .csv .bt .ot)
    #[arg(
        short = 'o',
        long = "output",
        value_name = "FILE",
        required = false,
        required_unless_present = "scans",
        default_value_if("scans", ArgPredicate::IsPresent, "-")
    )]
    pub output: PathBuf,
    /// Export the kept scans to this folder instead of voxels: one .pcd per scan, with a field
    /// moving (0 or 1) if clean has marked points, and poses_tum.txt
    #[arg(long, value_name = "DIR", conflicts_with_all = ["output", "format", "what", "region", "origin"])]
    pub scans: Option<PathBuf>,
    /// With --scans: only the points that clean has marked as moving
    #[arg(long, requires = "scans")]
    pub only_moving: bool,
    /// Format to write, whatever the extension
    #[arg(long, value_name = "FORMAT", value_parser = format_names())]
    pub format: Option<String>,
    /// Only voxels of at least this probability; 0 exports all observed voxels [default: the map's threshold]
    #[arg(long, value_name = "P")]
    pub min_probability: Option<f64>,
    /// Voxels to export [default: occupied; all for .pgm]
    #[arg(long, value_name = "WHICH", conflicts_with = "min_probability")]
    pub what: Option<WhatName>,
    /// Write no colours, intensities, classes and times of the map's layers: .ot then is an OcTree, not a ColorOcTree, and
    /// .glb has colours of heights
    #[arg(long)]
    pub no_layers: bool,
    /// Only voxels of these classes, such as 2,6, each the class of most of its points; the map needs the layer class
    #[arg(long, value_name = "CLASSES", value_delimiter = ',')]
    pub only_class: Vec<u8>,
    /// Files of points: write the mean of the points in a voxel in place of its center; the map needs the layer shape
    #[arg(long)]
    pub mean_points: bool,
    /// .pgm, .png, .tif: only voxels that reach above this height, in metres
    #[arg(long, value_name = "M")]
    pub z_min: Option<f64>,
    /// .pgm, .png, .tif: only voxels that reach below this height, in metres
    #[arg(long, value_name = "M")]
    pub z_max: Option<f64>,
    /// autoware: edge length of a square, one file each, in whole metres [default: 20]
    #[arg(long, value_name = "M")]
    pub cell: Option<f64>,
    /// .glb: positions as 16-bit numbers (KHR_mesh_quantization) where they suffice, for files a fifth smaller; Open3D
    /// and other programs misread them
    #[arg(long)]
    pub quantize: bool,
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6, help = help::VOXELS_IN_BOX)]
    pub region: Option<Vec<f64>>,
    /// Origin of the file in the map, in metres, moved to the nearest voxel corner: subtracted from all coordinates and
    /// recorded in the summary and FILE.origin.json. A map far from its origin needs it for .bt and .ot; .pcd chooses
    /// one if float32 is too coarse [default: 0 0 0]
    #[arg(long, value_names = ["X", "Y", "Z"], num_args = 3)]
    pub origin: Option<Vec<f64>>,
    /// .las, .laz, .copc.laz, .e57, .parquet, .tif: coordinate system of the file, as EPSG:2230 or well-known text; if
    /// it is in feet, so is the file [default: that of the map]
    #[arg(long, value_name = "CRS")]
    pub crs: Option<String>,
    /// .las, .laz, .copc.laz, .xyz, .tif: unit of coordinates and heights [default: that of --crs, otherwise m]
    #[arg(long, value_name = "UNIT", value_parser = unit_names())]
    pub unit: Option<String>,
    /// Memory for assembling a .bt or .ot file, in addition to one tile, such as 64MiB or 1GiB [default: 64MiB]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<ByteSize>,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

/// Names and help texts of all formats.
fn format_names() -> PossibleValuesParser {
    let formats = OutputFormats::default();
    formats.all().iter().map(|format| PossibleValue::new(format.name).help(format.help)).into()
}

/// Names of all units of files.
fn unit_names() -> PossibleValuesParser {
    FileUnit::ALL.map(FileUnit::name).into()
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WhatName {
    /// Voxels from the map's threshold on
    Occupied,
    /// Observed voxels below the threshold
    Free,
    /// All observed voxels
    All,
}
