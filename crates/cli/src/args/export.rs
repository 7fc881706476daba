use bytesize::ByteSize;
use clap::builder::{ArgPredicate, PossibleValue, PossibleValuesParser};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use voxtile_formats::write::OutputFormats;

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct ExportArgs {
    /// Folder of the map, FOLDER@SNAPSHOT, or an OctoMap file (.bt .ot)
    pub map: PathBuf,
    /// File to write; its extension says what: .ply .pcd .csv .xyz .npz .las .laz .copc.laz .e57 .parquet .mcap hold
    /// voxels, .glb their surface, .pgm a flat map of nav2, .png heights, .bt .ot the whole octree. - is standard
    /// output (.ply .pcd .csv .bt .ot)
    #[arg(
        short = 'o',
        long = "output",
        value_name = "FILE",
        required = false,
        required_unless_present = "scans",
        default_value_if("scans", ArgPredicate::IsPresent, "-")
    )]
    pub output: PathBuf,
    /// In place of voxels, write the scans that the map keeps into this folder: a .pcd each, and poses_tum.txt
    #[arg(long, value_name = "DIR", conflicts_with_all = ["output", "format", "what", "region", "origin"])]
    pub scans: Option<PathBuf>,
    /// What to write, whatever the extension
    #[arg(long, value_name = "FORMAT", value_parser = format_names())]
    pub format: Option<String>,
    /// Voxels of at least this probability; 0 takes all observed ones [default: the map's occupancy threshold]
    #[arg(long, value_name = "P")]
    pub min_probability: Option<f64>,
    /// Which voxels [default: occupied; all for .pgm]
    #[arg(long, value_name = "WHICH", conflicts_with = "min_probability")]
    pub what: Option<WhatName>,
    /// .pgm, .png: only voxels that reach above this height, in metres
    #[arg(long, value_name = "M")]
    pub z_min: Option<f64>,
    /// .pgm, .png: only voxels that reach below this height, in metres
    #[arg(long, value_name = "M")]
    pub z_max: Option<f64>,
    /// autoware: edge of the square of a file, in whole metres [default: 20]
    #[arg(long, value_name = "M")]
    pub cell: Option<f64>,
    /// .glb: positions as 16-bit numbers (KHR_mesh_quantization) where these suffice, for a fifth less of a file;
    /// Open3D and other programs misread them
    #[arg(long)]
    pub quantize: bool,
    /// Only voxels whose center is in this box: X0 <= x < X1 and so on, in metres
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6)]
    pub region: Option<Vec<f64>>,
    /// Coordinates in the file are those of the map less this, in metres: the nearest corner of a voxel, said in the
    /// summary and in FILE.origin.json. A map far from its origin needs it as .bt or .ot; a .pcd chooses one where
    /// float32 is too coarse [default: 0 0 0]
    #[arg(long, value_names = ["X", "Y", "Z"], num_args = 3)]
    pub origin: Option<Vec<f64>>,
    /// Memory for putting a .bt or .ot file together, beside that of one tile (64MiB, 1GiB)
    /// [default: 64MiB]
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<ByteSize>,
    /// Print the summary as JSON
    #[arg(long)]
    pub json: bool,
}

/// The names of all formats, with what they are.
fn format_names() -> PossibleValuesParser {
    let formats = OutputFormats::default();
    formats.all().iter().map(|format| PossibleValue::new(format.name).help(format.help)).into()
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WhatName {
    /// From the map's threshold on
    Occupied,
    /// Observed and below it
    Free,
    /// All that were observed
    All,
}
