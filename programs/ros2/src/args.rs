use crate::when_behind::WhenBehind;
use bytesize::ByteSize;
use clap::Parser;
use std::path::PathBuf;

/// Map what the sensors of a robot see, from ROS 2 over DDS, into a map of voxtile. Lengths are metres, times seconds.
#[derive(Clone, Debug, Parser)]
#[command(name = "voxtile-ros2", version, max_term_width = 80)]
pub struct Args {
    /// Folder of the map; made if it is not there, gone on with if it is
    #[arg(short = 'o', long = "output", value_name = "MAP")]
    pub output: PathBuf,
    /// Topic of clouds (sensor_msgs/PointCloud2); give it again for each sensor
    #[arg(long, value_name = "TOPIC", default_value = "/cloud_in")]
    pub cloud: Vec<String>,
    /// Frame of the map
    #[arg(long, value_name = "FRAME", default_value = "map")]
    pub frame_id: String,
    /// Poses from a topic of nav_msgs/Odometry instead of /tf; mounts still come from /tf_static
    #[arg(long, value_name = "TOPIC")]
    pub odometry: Option<String>,
    /// How long a cloud waits for the transforms around its stamp before it is dropped
    #[arg(long, value_name = "S", default_value_t = 1.0)]
    pub transform_wait: f64,
    /// Largest gap between two transforms of a frame in which a pose is found
    #[arg(long, value_name = "S", default_value_t = 0.5)]
    pub pose_tolerance: f64,

    /// Edge of a voxel of a new map
    #[arg(long, value_name = "M", default_value_t = 0.05)]
    pub resolution: f64,
    /// Edge of a tile of a new map
    #[arg(long, value_name = "M", default_value_t = 10.0)]
    pub tile_size: f64,
    /// Points nearer than this are left out
    #[arg(long, value_name = "M", default_value_t = 0.0)]
    pub min_range: f64,
    /// Rays are cut at this length
    #[arg(long, value_name = "M")]
    pub max_range: Option<f64>,
    /// Memory for the map and for clouds that wait; the clouds get an eighth
    #[arg(long, value_name = "SIZE", default_value = "1GiB")]
    pub memory: ByteSize,
    /// Flush so often
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    pub flush_every: f64,
    /// What becomes of clouds that come faster than they can be mapped
    #[arg(long, value_enum, default_value_t = WhenBehind::DropOldest)]
    pub when_behind: WhenBehind,

    /// DDS domain
    #[arg(long, value_name = "ID", env = "ROS_DOMAIN_ID", default_value_t = 0)]
    #[arg(value_parser = clap::value_parser!(u16).range(0..=232))]
    pub domain_id: u16,
    /// Talk to other machines too; without it, the loopback interface alone is used
    #[arg(long)]
    pub network: bool,
}

impl Args {
    /// Bytes of clouds that may wait.
    pub fn queue_bytes(&self) -> usize {
        self.memory_bytes() / 8
    }

    /// Bytes of the mapper.
    pub fn map_bytes(&self) -> usize {
        self.memory_bytes() - self.queue_bytes()
    }

    fn memory_bytes(&self) -> usize {
        usize::try_from(self.memory.as_u64()).unwrap_or(usize::MAX)
    }
}
