use super::help;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use voxtile_formats::Registry;

/// Options of the input and of its conversion to scans.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct ReadArgs {
    #[arg(long, value_name = "NAME", help = format_help())]
    pub format: Option<String>,
    /// Topic of the point clouds of a recording, if it has several
    #[arg(long, value_name = "TOPIC")]
    pub topic: Option<String>,
    /// Topic of the poses of a recording (Odometry, PoseStamped, Path) [default: /tf and /tf_static]
    #[arg(long, value_name = "TOPIC")]
    pub odometry: Option<String>,
    /// World frame of a recording [default: map, odom, or the root of its frame tree]
    #[arg(long, value_name = "FRAME")]
    pub fixed_frame: Option<String>,
    /// Columns of a .bin file with optional types, float32 by default, such as x,y,z,intensity,ring:u16,t:f64; required
    /// if the content does not fit the default [default: x,y,z,intensity]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub fields: Option<Vec<String>>,
    /// Skip the first N scans
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub first: u64,
    /// Read at most N scans
    #[arg(long, value_name = "N")]
    pub count: Option<u64>,
    /// Read every Nth scan
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub every: u64,
    /// Poses, sensor to world: a file in TUM format (t tx ty tz qx qy qz qw), KITTI format (3x4 matrix row by row), CSV
    /// with a header, or .npy; or identity for scans in the world frame. Matched by time stamp if the scans have one,
    /// else line by line [default: from the input, else poses_tum.txt or poses_kitti.txt in it or next to it, else the
    /// VIEWPOINT of PCD files]
    #[arg(long, value_name = "FILE")]
    pub poses: Option<PathBuf>,
    #[arg(long, value_name = "FILE", requires = "poses", help = help::CALIB)]
    pub calib: Option<PathBuf>,
    #[arg(long, value_name = "S", default_value_t = 0.5, help = help::POSE_TOLERANCE)]
    pub pose_tolerance: f64,
    #[arg(long, value_name = "N", num_args = 7..=12, help = help::EXTRINSIC)]
    pub extrinsic: Option<Vec<f64>>,
    /// Points are already in the world frame; poses give the position of the sensor
    #[arg(long)]
    pub world_frame: bool,
    /// Correct each point for the sensor's motion during the scan, by its own time stamp and the neighbouring poses
    #[arg(long, conflicts_with = "world_frame")]
    pub deskew: bool,
    /// Skip points in this box, such as the robot itself, in metres
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6)]
    pub ignore_box: Option<Vec<f64>>,
    /// Frame of --ignore-box; body needs --extrinsic
    #[arg(long, value_name = "FRAME", default_value = "sensor")]
    pub ignore_frame: FrameName,
    /// Round coordinates of points to multiples of this step, in metres, such as 0.001. Loses information; kept scans of
    /// lidars take about half the space
    #[arg(long, value_name = "M")]
    pub round_points: Option<f64>,
    /// Read only points of these classes, such as 2,6: of LAS, .label files, and fields label or class [default: all]
    #[arg(long, value_name = "CLASSES", value_delimiter = ',')]
    pub only_class: Vec<u8>,
    /// Skip points of these classes; 7,18 are noise in LAS
    #[arg(long, value_name = "CLASSES", value_delimiter = ',')]
    pub skip_class: Vec<u8>,
    /// LAS: returns of a pulse to read
    #[arg(long, value_name = "WHICH", default_value = "all")]
    pub returns: ReturnsName,
    /// LAS with GPS times: duration of a scan, in seconds; 0 reads a file as one scan
    #[arg(long, value_name = "S", default_value_t = 0.1)]
    pub scan_period: f64,
    /// Position of the sensor for a single cloud in the world frame, in metres
    #[arg(long, value_names = ["X", "Y", "Z"], num_args = 3)]
    pub sensor_origin: Option<Vec<f64>>,
    /// Units of a depth image per metre [default: 5000 for TUM RGB-D, else 1000]
    #[arg(long, value_name = "N")]
    pub depth_scale: Option<f64>,
    /// Camera of depth images: file with fx fy cx cy or a 3x3 matrix [default: camera-intrinsics.txt in the input or
    /// next to it]
    #[arg(long, value_name = "FILE")]
    pub intrinsics: Option<PathBuf>,
}

fn format_help() -> String {
    let known = Registry::default().names(" ");
    format!("Format of the input, if its content does not identify it: {known}")
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ReturnsName {
    /// All returns
    All,
    /// The first return of each pulse
    First,
    /// The last return of each pulse
    Last,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FrameName {
    /// Frame of the points
    Sensor,
    /// Frame of the poses
    Body,
}
