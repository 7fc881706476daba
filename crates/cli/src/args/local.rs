use super::ReadArgs;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct LocalArgs {
    /// Scans: a folder of point clouds (PCD, PLY, LAS, KITTI .bin, depth images) in the sensor's frame or one that
    /// holds it as scans/, a recording (.bag .mcap .db3, a rosbag2 folder), one file (.laz .e57 .xyz ...), OctoMap's
    /// .graph and .log, a scan stream (.scans), or - for a scan stream from standard input
    #[arg(value_name = "SCANS")]
    pub scans: PathBuf,
    /// What the map is for
    #[arg(long, value_name = "NAME", default_value = "local")]
    pub preset: PresetName,
    /// Most voxels with occupancy; 0 for no limit [default: the preset's]
    #[arg(long, value_name = "N")]
    pub n_lim: Option<usize>,
    /// Skip points farther from the sensor than this, in metres; inf for none [default: the preset's]
    #[arg(long, value_name = "M")]
    pub d_in: Option<f64>,
    /// Inflate up to this far from the sensor, in metres; inf for all [default: the preset's]
    #[arg(long, value_name = "M")]
    pub d_inf: Option<f64>,
    /// Inflate voxels up to this far from an occupied one, in metres
    #[arg(long, value_name = "M", default_value_t = 0.2)]
    pub radius: f64,
    /// Probability of a voxel before its first hit
    #[arg(long, value_name = "P", default_value_t = 0.5)]
    pub p_init: f64,
    /// Skip points nearer to the sensor than this, in metres
    #[arg(long, value_name = "M", default_value_t = 0.0)]
    pub min_range: f64,
    /// Edge of a voxel in metres
    #[arg(long, value_name = "M", default_value_t = 0.1)]
    pub resolution: f64,
    /// Take about so many points of each scan, evenly [default: all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub points: Option<u32>,
    /// Run the scans so many times, and count for each update the least of its times: what others do on the machine
    /// adds to some, never to all
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repeat: u32,
    /// Picture of the map at several times
    #[arg(short = 'o', long = "output", value_name = "FILE", default_value = "local_map.png")]
    pub output: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub read: ReadArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PresetName {
    /// For a planner that reacts: near in space and time
    Local,
    /// For navigation that maps on its way: everything, inflated near the robot
    Autonomous,
    /// For a robot that listens to others: far input, all of it inflated
    Passive,
}
