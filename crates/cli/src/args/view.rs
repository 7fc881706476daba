use clap::Args;
use std::net::SocketAddr;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct ViewArgs {
    /// Folders of maps, FOLDER@SNAPSHOT, or OctoMap files (.bt .ot); several are shown as layers
    #[arg(required = true, value_name = "MAP")]
    pub maps: Vec<PathBuf>,
    /// Address and port to listen on; port 0 takes a free one. Beyond this machine, say 0.0.0.0:8000: whoever knows the
    /// token sees the maps, and nothing is encrypted
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:0")]
    pub listen: SocketAddr,
    /// Secret part of the URL, 8 to 128 of A-Z a-z 0-9 _ - [default: a random one]
    #[arg(long, value_name = "TOKEN")]
    pub token: Option<String>,
    /// Open no browser; say where to look
    #[arg(long)]
    pub no_browser: bool,
    /// Keep nothing for the next time; otherwise coarse levels of the map are kept in the user's cache folder
    #[arg(long)]
    pub no_cache: bool,
    /// Print JSON: the URL
    #[arg(long)]
    pub json: bool,
}
