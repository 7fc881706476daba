use crate::robot_name::RobotName;
use bytesize::ByteSize;
use clap::{ArgGroup, Parser};
use std::path::PathBuf;
use std::time::Duration;
use voxtile::Error;
use voxtile_share::{ExportPolicy, SenderConfig};

/// Share occupied voxels with other robots: publish a map or scans, or subscribe to other robots.
///
/// A publisher and a subscriber on the same machine need only --publish and --subscribe. Set other endpoints with
/// --listen and --connect. Lengths are in metres, times in seconds.
#[derive(Debug, Parser)]
#[command(name = "voxtile share", bin_name = "voxtile share", version, max_term_width = 80)]
#[command(group = ArgGroup::new("what").required(true).args(["publish", "subscribe", "fold", "measure", "man"]))]
pub struct Args {
    /// Publish the occupied voxels of a map, or of scans while they are mapped (inputs as for voxtile build)
    #[arg(long, value_name = "MAP_OR_SCANS")]
    pub publish: Option<PathBuf>,
    /// Keep one layer per robot in MAP.layers and fold the layers into MAP at the end
    #[arg(long)]
    pub subscribe: bool,
    /// Fold one layer into MAP: each voxel of the layer that is not occupied in MAP gets one hit
    #[arg(long, value_name = "LAYER")]
    pub fold: Option<PathBuf>,
    /// Measure the bytes to share scans over a simulated link (see --points, --latency, --loss); uses no network
    #[arg(long, value_name = "SCANS", num_args = 1..)]
    pub measure: Vec<PathBuf>,
    /// Map folder into which layers are folded; created if missing
    #[arg(short = 'o', long = "output", value_name = "MAP")]
    pub output: Option<PathBuf>,
    /// Name of this robot (1 to 32 of A-Z a-z 0-9 _ -); with --subscribe, the robots to accept [default: all]
    #[arg(long, value_name = "NAME")]
    pub robot: Vec<RobotName>,

    /// Listen at an endpoint such as tcp/0.0.0.0:7447 or tls/0.0.0.0:7447 [default with --publish: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT", help_heading = "Network")]
    pub listen: Vec<String>,
    /// Connect to an endpoint [default with --subscribe: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT", help_heading = "Network")]
    pub connect: Vec<String>,
    /// Discover other robots by multicast
    #[arg(long, help_heading = "Network")]
    pub scout: bool,
    /// Zenoh configuration file (JSON5) with TLS certificates, user and password or a router; options override it
    #[arg(long, value_name = "FILE", help_heading = "Network")]
    pub zenoh_config: Option<PathBuf>,

    /// Minimum occupancy probability of a shared voxel
    #[arg(long, value_name = "P", default_value_t = 0.5, help_heading = "Publishing")]
    pub threshold: f64,
    /// Longest delay before a change is sent; a longer delay sends larger batches and fewer bytes
    #[arg(long, value_name = "S", default_value_t = 1.0, help_heading = "Publishing")]
    pub latency: f64,
    /// Content of a frame: last (latest changes), ring:N (changes of the last N frames) or everything
    #[arg(long, value_name = "POLICY", default_value = "last", value_parser = policy, help_heading = "Publishing")]
    pub policy: ExportPolicy,
    /// Largest packet in bytes, 256 to 60000
    #[arg(long, value_name = "N", default_value_t = 1200, help_heading = "Publishing")]
    pub packet_bytes: usize,
    /// Scans per second
    #[arg(long, value_name = "HZ", default_value_t = 10.0, help_heading = "Publishing")]
    pub rate: f64,
    /// Voxel size for scans
    #[arg(long, value_name = "M", default_value_t = 0.1, help_heading = "Publishing")]
    pub resolution: f64,
    /// Cut the rays of scans at this range
    #[arg(long, value_name = "M", default_value_t = 100.0, help_heading = "Publishing")]
    pub max_range: f64,
    /// Subsample each scan to N points, at even steps [default: all]
    #[arg(long, value_name = "N", help_heading = "Publishing")]
    pub points: Option<usize>,
    /// File of poses, as for voxtile build
    #[arg(long, value_name = "FILE", help_heading = "Publishing")]
    pub poses: Option<PathBuf>,

    /// Stop after S seconds [default: on Ctrl-C or SIGTERM]
    #[arg(long = "for", value_name = "S")]
    pub seconds: Option<f64>,
    /// With --subscribe: stop once a layer exists, each robot given with --robot has one, and all layers have equalled
    /// the robots' sets for three seconds
    #[arg(long)]
    pub until_equal: bool,
    /// With --subscribe: keep the layers only; do not change MAP
    #[arg(long)]
    pub keep_apart: bool,
    /// Memory for all layers. When it is full, each robot may use an equal share: robots above it drop voxels as others
    /// need memory, and new voxels beyond it are refused
    #[arg(long, value_name = "SIZE", default_value = "512MiB", help_heading = "Limits")]
    pub memory: ByteSize,
    /// Maximum number of robots; robots given with --robot are always accepted
    #[arg(long, value_name = "N", default_value_t = 64, help_heading = "Limits")]
    pub max_robots: usize,
    /// Maximum number of voxels per robot
    #[arg(long, value_name = "N", default_value_t = 1 << 26, help_heading = "Limits")]
    pub max_voxels: u64,
    /// Maximum number of tiles per robot
    #[arg(long, value_name = "N", default_value_t = 1 << 17, help_heading = "Limits")]
    pub max_tiles: usize,
    /// Refuse voxels outside this box
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6, allow_negative_numbers = true)]
    #[arg(help_heading = "Limits")]
    pub region: Option<Vec<f64>>,

    /// With --measure: fraction of packets lost in each direction
    #[arg(long, value_name = "P", default_value_t = 0.0, help_heading = "Measuring")]
    pub loss: f64,
    /// With --measure: time between two scans
    #[arg(long, value_name = "S", default_value_t = 0.1, help_heading = "Measuring")]
    pub period: f64,
    /// With --measure: cut the link for S seconds in the middle of the run
    #[arg(long, value_name = "S", default_value_t = 0.0, help_heading = "Measuring")]
    pub cut: f64,
    /// With --measure: send no catch-up requests, to measure a policy alone
    #[arg(long, help_heading = "Measuring")]
    pub no_catch_up: bool,
    /// With --measure: write the codec's probability table as counted in these scans
    #[arg(long, value_name = "FILE", help_heading = "Measuring")]
    pub write_prior: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Print the man page
    #[arg(long, hide = true)]
    pub man: bool,
}

/// Action selected on the command line.
pub enum Mode {
    Publish(PathBuf),
    Subscribe(PathBuf),
    Fold(PathBuf, PathBuf),
    Measure(Vec<PathBuf>),
    Man,
}

impl Args {
    pub fn mode(&self) -> anyhow::Result<Mode> {
        let output = || {
            let missing =
                || Error::argument("-o", "give the map folder for the layers; it is created if missing");
            self.output.clone().ok_or_else(missing)
        };
        if self.man {
            return Ok(Mode::Man);
        }
        if let Some(source) = &self.publish {
            if self.robot.len() != 1 {
                return Err(Error::argument("--robot", "give exactly one name with --publish").into());
            }
            return Ok(Mode::Publish(source.clone()));
        }
        if let Some(layer) = &self.fold {
            return Ok(Mode::Fold(layer.clone(), output()?));
        }
        if !self.measure.is_empty() {
            return Ok(Mode::Measure(self.measure.clone()));
        }
        Ok(Mode::Subscribe(output()?))
    }

    pub fn sender_config(&self) -> anyhow::Result<SenderConfig> {
        let mut config = SenderConfig::default();
        config.policy = self.policy;
        config.latency = seconds("--latency", self.latency)?;
        config.max_packet_bytes = self.packet_bytes;
        Ok(config)
    }
}

/// Converts a command-line value in seconds.
pub fn seconds(argument: &str, seconds: f64) -> anyhow::Result<Duration> {
    let time = Duration::try_from_secs_f64(seconds).ok().filter(|time| *time <= Duration::from_secs(1 << 32));
    Ok(time.ok_or_else(|| Error::argument(argument, format!("{seconds} s is not a valid duration")))?)
}

fn policy(text: &str) -> Result<ExportPolicy, String> {
    match text {
        "last" => Ok(ExportPolicy::LastFrame),
        "everything" => Ok(ExportPolicy::Everything),
        _ => {
            let frames = text.strip_prefix("ring:").and_then(|frames| frames.parse().ok()).filter(|&n| n > 0);
            frames.map(ExportPolicy::Ring).ok_or_else(|| "expected last, ring:N or everything".to_string())
        }
    }
}
