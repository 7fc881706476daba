use super::{ReplayArgs, help};
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct CleanArgs {
    #[arg(help = help::MAP_WITH_SCANS)]
    pub map: PathBuf,
    /// Remove all marks: the map is that of before clean
    #[arg(long, conflicts_with_all = ["region", "parked_scans"])]
    pub undo: bool,
    /// Mark only points in a box (X0 <= x < X1, same for y and z), in metres, world frame; earlier marks outside of it
    /// are removed
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6)]
    pub region: Option<Vec<f64>>,
    /// Mark nothing that at least N scans hit in the same place, such as a parked car that leaves later [default:
    /// mark it]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub parked_scans: Option<u32>,
    #[command(flatten)]
    pub replay: ReplayArgs,
}
