use clap::Args;
use std::path::PathBuf;
use voxtile::store::SnapshotName;

#[derive(Debug, Args)]
pub struct SnapshotArgs {
    /// Folder of the map; no other process may be writing to it
    pub map: PathBuf,
    /// Name of the snapshot: 1 to 64 of A-Z a-z 0-9 . _ -, beginning with no dot, and not `now`
    pub name: SnapshotName,
    /// Delete the snapshot, and the bytes on disk that are there for it alone
    #[arg(long)]
    pub delete: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct SnapshotsArgs {
    /// Folder of the map
    pub map: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct RevertArgs {
    /// Folder of the map; no other process may be writing to it
    pub map: PathBuf,
    /// Name of the snapshot
    pub name: SnapshotName,
    /// Keep the map as it is now under this name first; without it, what came after the snapshot is gone
    #[arg(long, value_name = "NAME")]
    pub keep_as: Option<SnapshotName>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(
    override_usage = "voxtile diff [OPTIONS] <FROM> <TO>\n       voxtile diff [OPTIONS] <MAP> <SNAPSHOT|now> <SNAPSHOT|now>"
)]
pub struct DiffArgs {
    /// Two maps, each a folder or FOLDER@SNAPSHOT; or a folder and the names of two of its snapshots, `now` being the
    /// map as it is
    #[arg(value_name = "MAP", num_args = 2..=3, required = true)]
    pub sides: Vec<PathBuf>,
    /// Print JSON, with every tile that differs
    #[arg(long)]
    pub json: bool,
}
