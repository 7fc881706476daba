use super::help;
use clap::Args;
use std::path::PathBuf;
use voxtile::store::SnapshotName;

#[derive(Debug, Args)]
pub struct SnapshotArgs {
    #[arg(help = help::MAP_TO_WRITE)]
    pub map: PathBuf,
    /// Name of the snapshot: 1 to 64 characters of A-Z a-z 0-9 . _ -, not beginning with a dot, not `now`
    pub name: SnapshotName,
    /// Delete the snapshot and the data that only it uses
    #[arg(long)]
    pub delete: bool,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct SnapshotsArgs {
    #[arg(help = help::MAP)]
    pub map: PathBuf,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct RevertArgs {
    #[arg(help = help::MAP_TO_WRITE)]
    pub map: PathBuf,
    /// Name of the snapshot
    pub name: SnapshotName,
    #[arg(long, value_name = "NAME", help = help::KEEP_AS)]
    pub keep_as: Option<SnapshotName>,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(
    override_usage = "voxtile diff [OPTIONS] <FROM> <TO>\n       voxtile diff [OPTIONS] <MAP> <SNAPSHOT|now> <SNAPSHOT|now>"
)]
pub struct DiffArgs {
    /// Two maps, each a folder or FOLDER@SNAPSHOT; or a folder and two of its snapshots, where `now` is the current map
    #[arg(value_name = "MAP", num_args = 2..=3, required = true)]
    pub sides: Vec<PathBuf>,
    /// Print the result as JSON, including every tile that differs
    #[arg(long)]
    pub json: bool,
}
