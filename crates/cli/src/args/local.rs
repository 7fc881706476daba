use super::{ReadArgs, help};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct LocalArgs {
    #[arg(value_name = "SCANS", required = true, help = help::SCANS)]
    pub scans: Vec<PathBuf>,
    /// Parameter set for the use of the map
    #[arg(long, value_name = "NAME", default_value = "local")]
    pub preset: PresetName,
    /// Maximum number of stored voxels; 0 for no limit [default: the preset's]
    #[arg(long, value_name = "N")]
    pub n_lim: Option<usize>,
    /// Skip points farther from the sensor than this, in metres; inf for none [default: the preset's]
    #[arg(long, value_name = "M")]
    pub d_in: Option<f64>,
    /// Inflate occupied voxels up to this distance from the sensor, in metres; inf for all [default: the preset's]
    #[arg(long, value_name = "M")]
    pub d_inf: Option<f64>,
    /// Inflation radius around an occupied voxel, in metres
    #[arg(long, value_name = "M", default_value_t = 0.2)]
    pub radius: f64,
    /// Probability of a voxel before its first hit
    #[arg(long, value_name = "P", default_value_t = 0.5)]
    pub p_init: f64,
    #[arg(long, value_name = "M", default_value_t = 0.0, help = help::MIN_RANGE)]
    pub min_range: f64,
    #[arg(long, value_name = "M", default_value_t = 0.1, help = help::RESOLUTION)]
    pub resolution: f64,
    /// Use about N evenly spaced points of each scan [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub points: Option<u32>,
    /// Run the scans N times and report the minimum time of each update, which is least affected by other programs
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repeat: u32,
    /// Picture of the map at several times
    #[arg(short = 'o', long = "output", value_name = "FILE", default_value = "local_map.png")]
    pub output: PathBuf,
    #[arg(long, help = help::JSON)]
    pub json: bool,
    #[command(flatten)]
    pub read: ReadArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PresetName {
    /// Reactive planner: short range, recent observations
    Local,
    /// Autonomous navigation: full map, inflated near the robot
    Autonomous,
    /// Passive perception with input from other robots: long range, all of it inflated
    Passive,
}
