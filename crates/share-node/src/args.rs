use crate::robot_name::RobotName;
use bytesize::ByteSize;
use clap::{ArgGroup, Parser};
use std::path::PathBuf;
use std::time::Duration;
use voxtile::Error;
use voxtile_share::{ExportPolicy, SenderConfig};

/// Share what is occupied with other robots: publish a map or scans, subscribe to others.
///
/// One publisher and one subscriber on one machine need no options but --publish and --subscribe; anything else is said
/// with --listen and --connect. Lengths are metres, times seconds.
#[derive(Debug, Parser)]
#[command(name = "voxtile share", bin_name = "voxtile share", version, max_term_width = 80)]
#[command(group = ArgGroup::new("what").required(true).args(["publish", "subscribe", "fold", "measure", "man"]))]
pub struct Args {
    /// Share the occupied voxels of a map, or of scans while they are mapped (as for voxtile build)
    #[arg(long, value_name = "MAP_OR_SCANS")]
    pub publish: Option<PathBuf>,
    /// Keep a layer for each robot that is heard, in MAP.layers, and fold the layers into MAP at the end
    #[arg(long)]
    pub subscribe: bool,
    /// Fold one layer into MAP: each of its voxels that is not occupied there gets one hit
    #[arg(long, value_name = "LAYER")]
    pub fold: Option<PathBuf>,
    /// Say how many bytes sharing scans takes over a simulated link, with --points, --latency, --loss; no network
    #[arg(long, value_name = "SCANS", num_args = 1..)]
    pub measure: Vec<PathBuf>,
    /// Folder of the map that layers are folded into; made if it is not there
    #[arg(short = 'o', long = "output", value_name = "MAP")]
    pub output: Option<PathBuf>,
    /// Name of this robot ([A-Za-z0-9_-], up to 32), or with --subscribe the robots to listen to [default: all]
    #[arg(long, value_name = "NAME")]
    pub robot: Vec<RobotName>,

    /// Listen at an endpoint, such as tcp/0.0.0.0:7447 or tls/0.0.0.0:7447 [default with --publish: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT", help_heading = "Network")]
    pub listen: Vec<String>,
    /// Connect to an endpoint [default with --subscribe: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "ENDPOINT", help_heading = "Network")]
    pub connect: Vec<String>,
    /// Find others by multicast
    #[arg(long, help_heading = "Network")]
    pub scout: bool,
    /// A Zenoh configuration as JSON5: TLS certificates, user and password, a router; what is said here goes before it
    #[arg(long, value_name = "FILE", help_heading = "Network")]
    pub zenoh_config: Option<PathBuf>,

    /// Probability from which a voxel is shared
    #[arg(long, value_name = "P", default_value_t = 0.5, help_heading = "Publishing")]
    pub threshold: f64,
    /// How long a change may wait for others, so that they are sent together: longer takes fewer bytes
    #[arg(long, value_name = "S", default_value_t = 1.0, help_heading = "Publishing")]
    pub latency: f64,
    /// What a frame holds: last (what changed), ring:N (what changed in N frames) or everything
    #[arg(long, value_name = "POLICY", default_value = "last", value_parser = policy, help_heading = "Publishing")]
    pub policy: ExportPolicy,
    /// Most bytes of a packet, 256 to 60000
    #[arg(long, value_name = "N", default_value_t = 1200, help_heading = "Publishing")]
    pub packet_bytes: usize,
    /// Scans a second
    #[arg(long, value_name = "HZ", default_value_t = 10.0, help_heading = "Publishing")]
    pub rate: f64,
    /// Edge of a voxel of scans
    #[arg(long, value_name = "M", default_value_t = 0.1, help_heading = "Publishing")]
    pub resolution: f64,
    /// Cut rays of scans at this range
    #[arg(long, value_name = "M", default_value_t = 100.0, help_heading = "Publishing")]
    pub max_range: f64,
    /// Take about so many points of each scan, evenly [default: all]
    #[arg(long, value_name = "N", help_heading = "Publishing")]
    pub points: Option<usize>,
    /// File of poses, as for voxtile build
    #[arg(long, value_name = "FILE", help_heading = "Publishing")]
    pub poses: Option<PathBuf>,

    /// End after so many seconds [default: with Ctrl-C or SIGTERM]
    #[arg(long = "for", value_name = "S")]
    pub seconds: Option<f64>,
    /// Subscribing: end once the layer of every robot, and of each robot that --robot names, has equalled its set for
    /// three seconds
    #[arg(long)]
    pub until_equal: bool,
    /// Subscribing: leave MAP as it is; only keep the layers
    #[arg(long)]
    pub keep_apart: bool,
    /// Memory for the layers of all robots. Once it is full, every robot has a right to an equal part: who has more
    /// forgets voxels as others need theirs, and what a robot sends beyond its part is refused
    #[arg(long, value_name = "SIZE", default_value = "512MiB", help_heading = "Limits")]
    pub memory: ByteSize,
    /// Most robots that are listened to; robots that --robot names always are
    #[arg(long, value_name = "N", default_value_t = 64, help_heading = "Limits")]
    pub max_robots: usize,
    /// Most voxels of a robot
    #[arg(long, value_name = "N", default_value_t = 1 << 26, help_heading = "Limits")]
    pub max_voxels: u64,
    /// Most tiles of a robot
    #[arg(long, value_name = "N", default_value_t = 1 << 17, help_heading = "Limits")]
    pub max_tiles: usize,
    /// Refuse voxels outside of this box
    #[arg(long, value_names = ["X0", "Y0", "Z0", "X1", "Y1", "Z1"], num_args = 6, allow_negative_numbers = true)]
    #[arg(help_heading = "Limits")]
    pub region: Option<Vec<f64>>,

    /// Measuring: part of the packets that is lost, both ways
    #[arg(long, value_name = "P", default_value_t = 0.0, help_heading = "Measuring")]
    pub loss: f64,
    /// Measuring: time between two scans in seconds
    #[arg(long, value_name = "S", default_value_t = 0.1, help_heading = "Measuring")]
    pub period: f64,
    /// Measuring: cut the link for so many seconds in the middle
    #[arg(long, value_name = "S", default_value_t = 0.0, help_heading = "Measuring")]
    pub cut: f64,
    /// Measuring: leave out asks, to see what a policy alone brings across
    #[arg(long, help_heading = "Measuring")]
    pub no_catch_up: bool,
    /// Measuring: write the codec's table of probabilities as counted in these scans
    #[arg(long, value_name = "FILE", help_heading = "Measuring")]
    pub write_prior: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Print the man page
    #[arg(long, hide = true)]
    pub man: bool,
}

/// What is to be done.
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
            let missing = || Error::argument("-o", "name the map, existing or new, that layers go to");
            self.output.clone().ok_or_else(missing)
        };
        if self.man {
            return Ok(Mode::Man);
        }
        if let Some(source) = &self.publish {
            if self.robot.len() != 1 {
                return Err(Error::argument("--robot", "a publisher has one name").into());
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

/// A time of the command line.
pub fn seconds(argument: &str, seconds: f64) -> anyhow::Result<Duration> {
    let time = Duration::try_from_secs_f64(seconds).ok().filter(|time| *time <= Duration::from_secs(1 << 32));
    Ok(time.ok_or_else(|| Error::argument(argument, format!("{seconds} s is no time to wait")))?)
}

fn policy(text: &str) -> Result<ExportPolicy, String> {
    match text {
        "last" => Ok(ExportPolicy::LastFrame),
        "everything" => Ok(ExportPolicy::Everything),
        _ => {
            let frames = text.strip_prefix("ring:").and_then(|frames| frames.parse().ok()).filter(|&n| n > 0);
            frames.map(ExportPolicy::Ring).ok_or_else(|| "last, ring:N or everything".to_string())
        }
    }
}
