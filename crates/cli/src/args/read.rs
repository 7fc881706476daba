use clap::{Args, ValueEnum};
use std::path::PathBuf;
use voxtile_formats::Registry;

/// What is read, and how it becomes scans.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct ReadArgs {
    #[arg(long, value_name = "NAME", help = format_help())]
    pub format: Option<String>,
    /// Topic with the clouds of a recording, where there are several
    #[arg(long, value_name = "TOPIC")]
    pub topic: Option<String>,
    /// Topic with the poses of a recording (Odometry, PoseStamped, Path) [default: /tf and /tf_static]
    #[arg(long, value_name = "TOPIC")]
    pub odometry: Option<String>,
    /// Frame of a recording that is the world [default: map, odom, or the root of its tree]
    #[arg(long, value_name = "FRAME")]
    pub fixed_frame: Option<String>,
    /// Columns of a .bin file, each a float32 if no type stands behind it: x,y,z,intensity,ring:u16,t:f64; needed where
    /// its numbers look like other columns than the default [default: x,y,z,intensity]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub fields: Option<Vec<String>>,
    /// Pass over the first N scans
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub first: u64,
    /// Take at most N scans
    #[arg(long, value_name = "N")]
    pub count: Option<u64>,
    /// Take one of N scans
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub every: u64,
    /// File of poses, sensor to world: TUM (t tx ty tz qx qy qz qw), KITTI (3x4 matrix, row by row), CSV with a header,
    /// .npy; matched by time stamp where scans have one, else line by line; or identity: all scans are in the world
    /// frame [default: what the input has, else poses_tum.txt or poses_kitti.txt in or beside it, else the VIEWPOINT of
    /// PCD files]
    #[arg(long, value_name = "FILE")]
    pub poses: Option<PathBuf>,
    /// calib.txt of KITTI, if --poses are its official ones, of the camera
    #[arg(long, value_name = "FILE", requires = "poses")]
    pub calib: Option<PathBuf>,
    /// Most seconds from a scan to the nearer of the poses around it; gaps of up to twice as long are filled
    #[arg(long, value_name = "S", default_value_t = 0.5)]
    pub pose_tolerance: f64,
    /// Where the sensor is in the body that --poses are of: tx ty tz qx qy qz qw, or a 3x4 matrix row by row
    #[arg(long, value_name = "N", num_args = 7..=12)]
    pub extrinsic: Option<Vec<f64>>,
    /// The points are in the world frame already; poses say from where they were seen
    #[arg(long)]
    pub world_frame: bool,
    /// Move each point to where it was at the time of its scan, by its own time stamp and the poses around
    #[arg(long, conflicts_with = "world_frame")]
    pub deskew: bool,
    /// Leave out points in this box, which the robot sees of itself, in metres
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6)]
    pub ignore_box: Option<Vec<f64>>,
    /// Frame of that box; the body's needs --extrinsic
    #[arg(long, value_name = "FRAME", default_value = "sensor")]
    pub ignore_frame: FrameName,
    /// LAS with GPS times: cut into scans of so many seconds; 0 takes a file as one scan
    #[arg(long, value_name = "S", default_value_t = 0.1)]
    pub scan_period: f64,
    /// Where the sensor stood, for a cloud of one station in the world frame, in metres
    #[arg(long, value_names = ["X", "Y", "Z"], num_args = 3)]
    pub sensor_origin: Option<Vec<f64>>,
    /// Units of a depth image in a metre [default: 5000 for TUM RGB-D, else 1000]
    #[arg(long, value_name = "N")]
    pub depth_scale: Option<f64>,
    /// Camera of depth images: a file with fx fy cx cy or a 3x3 matrix [default: camera-intrinsics.txt in or beside it]
    #[arg(long, value_name = "FILE")]
    pub intrinsics: Option<PathBuf>,
}

fn format_help() -> String {
    let known = Registry::default().names(" ");
    format!("Format of the input, where its content does not tell: {known}")
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FrameName {
    /// The points' own
    Sensor,
    /// The one that poses are of
    Body,
}
