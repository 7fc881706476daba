use clap::Args;
use std::net::SocketAddr;
use std::path::PathBuf;

#[derive(Debug, Args)]
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
    /// Print the URL as JSON
    #[arg(long)]
    pub json: bool,
}
