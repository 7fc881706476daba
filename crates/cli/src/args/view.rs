use clap::Args;
use std::net::SocketAddr;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct ViewArgs {
    /// Folders of maps, FOLDER@SNAPSHOT, or OctoMap files (.bt .ot); each map is a layer
    #[arg(required = true, value_name = "MAP")]
    pub maps: Vec<PathBuf>,
    /// Later map: show the changes from the map to this one, by class, with a list of the largest
    #[arg(long, value_name = "MAP")]
    pub compare: Option<PathBuf>,
    /// With --compare: distance along each axis within which occupied voxels are the same surface, in metres, at most 16
    /// voxels [default: one voxel]
    #[arg(long, value_name = "M", requires = "compare")]
    pub tolerance: Option<f64>,
    /// With --compare: number of connected voxels from which on a change is listed [default: 8]
    #[arg(long, value_name = "N", requires = "compare")]
    pub min_voxels: Option<u64>,
    /// With --compare: probability, above 0.5, with which one map must know a changed voxel as occupied and the other as
    /// free [default: 0.7]
    #[arg(long, value_name = "P", requires = "compare")]
    pub certainty: Option<f64>,
    /// Address and port of the server; port 0 selects a free one. Use 0.0.0.0:8000 for access from other machines: any
    /// client with the token can read the maps, unencrypted
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:0")]
    pub listen: SocketAddr,
    /// Secret part of the URL, 8 to 128 characters of A-Z a-z 0-9 _ - [default: random]
    #[arg(long, value_name = "TOKEN")]
    pub token: Option<String>,
    /// Print the URL without opening a browser
    #[arg(long)]
    pub no_browser: bool,
    /// Do not store coarse levels of the map in the user's cache folder for the next time
    #[arg(long)]
    pub no_cache: bool,
    /// Write the page into this folder instead, with all that it shows as files: any static web server can serve it,
    /// such as `python3 -m http.server`. The folder must be absent or empty
    #[arg(long, value_name = "DIR", conflicts_with_all = ["compare", "listen", "token", "no_browser"])]
    pub export_page: Option<PathBuf>,
    /// With --export-page: only tiles with their center in this box, in metres
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6, requires = "export_page")]
    pub region: Option<Vec<f64>>,
    /// With --export-page: finest level to write. Voxels of level N have 2^N times the edge of the map's voxels; each
    /// level more makes the folder smaller by a factor of about four
    #[arg(long, value_name = "N", default_value_t = 0, requires = "export_page")]
    pub finest: u8,
    /// Print the URL, or a summary of the exported page, as JSON
    #[arg(long)]
    pub json: bool,
}
