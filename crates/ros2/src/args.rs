use crate::names::Names;
use crate::publishers::Extent;
use crate::services::Rmw;
use crate::transport::TransportName;
use crate::when_behind::WhenBehind;
use anyhow::ensure;
use bytesize::ByteSize;
use clap::Parser;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::path::PathBuf;
use std::time::Duration;
use voxtile::sensor::LogOdds;
use voxtile::{MapConfig, SensorModel};
use voxtile_local::LocalParameters;

const DEFAULT_INFLATION_M: f64 = 0.2;

/// Map what the sensors of a robot see, from ROS 2, into a map of voxtile. Lengths are metres, times seconds.
// Options of a command line for clap, parameters of ROS for serde: the same names, types and limits.
#[derive(Clone, Debug, Parser, Serialize, Deserialize)]
#[command(name = "voxtile-ros2", version, max_term_width = 80, args_override_self = true)]
pub struct Args {
    /// Folder of the map; made if it is not there, gone on with if it is
    #[arg(short = 'o', long = "output", value_name = "MAP")]
    pub output: PathBuf,
    /// Options from a parameter file of ROS 2; those on the command line win, and a later file over an earlier one
    #[arg(long, value_name = "FILE")]
    pub params_file: Vec<PathBuf>,
    /// Topic of clouds (sensor_msgs/PointCloud2); give it again for each sensor
    #[arg(long, value_name = "TOPIC", default_value = "cloud_in")]
    #[serde(deserialize_with = "one_or_more")]
    pub cloud: Vec<String>,
    /// Frame of the map
    #[arg(long, value_name = "FRAME", default_value = "map")]
    pub frame_id: String,
    /// Poses from a topic of nav_msgs/Odometry instead of /tf; mounts still come from /tf_static
    #[arg(long, value_name = "TOPIC")]
    pub odometry: Option<String>,
    /// Corrected poses of the sensor at the stamps of its clouds, from a topic of nav_msgs/Path: what moved clouds
    /// touch is mapped again beside the mapping. Keeps the scans, and takes one topic of clouds
    #[arg(long, value_name = "TOPIC")]
    pub path: Option<String>,
    /// A path by which no scan moves farther than this, or turns by half a degree, changes nothing
    #[arg(long, value_name = "M", default_value_t = 0.05, value_parser = metres, allow_negative_numbers = true)]
    #[serde(deserialize_with = "metres_of")]
    pub path_tolerance: f64,
    /// How long a cloud waits for the transforms around its stamp before it is dropped
    #[arg(long, value_name = "S", default_value = "1", value_parser = seconds, allow_negative_numbers = true)]
    #[serde(serialize_with = "as_seconds", deserialize_with = "seconds_of")]
    pub transform_wait: Duration,
    /// Most seconds from a cloud to the nearer of the transforms of a frame around it; gaps of up to twice as long
    /// are filled
    #[arg(long, value_name = "S", default_value = "0.5", value_parser = seconds, allow_negative_numbers = true)]
    #[serde(serialize_with = "as_seconds", deserialize_with = "seconds_of")]
    pub pose_tolerance: Duration,

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
    /// Probability of being occupied that a hit stands for, of a new map [default: 0.7]
    #[arg(long, value_name = "P")]
    pub hit: Option<f64>,
    /// The same of a miss [default: 0.4]
    #[arg(long, value_name = "P")]
    pub miss: Option<f64>,
    /// Least probability that a voxel gets, of a new map [default: 0.1192]
    #[arg(long, value_name = "P")]
    pub clamp_min: Option<f64>,
    /// Most probability that a voxel gets, of a new map [default: 0.971]
    #[arg(long, value_name = "P")]
    pub clamp_max: Option<f64>,
    /// Keep the scans in a new map, so that it can follow its trajectory
    #[arg(long)]
    pub keep_scans: bool,
    /// Memory for the map and for clouds until they are mapped; the clouds get an eighth, and remapping for --path a quarter
    #[arg(long, value_name = "SIZE", default_value = "1GiB")]
    #[serde(serialize_with = "as_bytes")]
    pub memory: ByteSize,
    /// Flush so often
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    pub flush_every: f64,
    /// What becomes of clouds that come faster than they can be mapped
    #[arg(long, value_enum, default_value_t = WhenBehind::DropOldest)]
    pub when_behind: WhenBehind,

    /// Publish what changed so often, to those who listen
    #[arg(long, value_name = "S", default_value_t = 1.0)]
    pub publish_every: f64,
    /// Publish the box around the sensor that reaches so far
    #[arg(long, value_name = "M", default_value_t = 20.0)]
    pub publish_radius: f64,
    /// The same for projected_map [default: that of --publish-radius]
    #[arg(long, value_name = "M")]
    pub projected_radius: Option<f64>,
    /// Voxels below this height are left out of clouds, cubes and projected_map
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub occupancy_min_z: Option<f64>,
    /// Voxels above this height are left out of clouds, cubes and projected_map
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub occupancy_max_z: Option<f64>,

    /// Points farther from the sensor than this do not enter the local map
    #[arg(long, value_name = "M", default_value_t = 40.0)]
    pub local_range: f64,
    /// Most voxels of the local map; those seen longest ago are forgotten
    #[arg(long, value_name = "N", default_value_t = 50_000)]
    pub local_max_voxels: usize,
    /// Voxels so near to an occupied one are inflated [default: 0.2, or 20 voxels where these are less]
    #[arg(long, value_name = "M")]
    pub inflation_radius: Option<f64>,
    /// Occupied voxels so near to the sensor inflate others
    #[arg(long, value_name = "M", default_value_t = 8.0)]
    pub inflation_range: f64,

    /// Name of the node, of which some services are named after
    #[arg(long, value_name = "NAME", default_value = "voxtile_ros2")]
    pub node_name: String,
    /// Namespace of the node, in which names without a slash in front are
    #[arg(long, value_name = "NS", default_value = "/")]
    pub namespace: String,
    /// Gives a topic or a service another name; give it again for each
    #[arg(long, value_name = "FROM:=TO")]
    pub remap: Vec<String>,
    /// What carries messages: DDS, or Zenoh as rmw_zenoh_cpp speaks it
    #[arg(long, value_enum, default_value_t = TransportName::Dds)]
    pub transport: TransportName,
    /// Router of Zenoh; give it again for each
    #[arg(long, value_name = "ENDPOINT", default_value = "tcp/localhost:7447")]
    #[serde(deserialize_with = "one_or_more")]
    pub zenoh_router: Vec<String>,
    /// Configuration of Zenoh (JSON5), instead of --zenoh-router and --network
    #[arg(long, value_name = "FILE", conflicts_with_all = ["zenoh_router", "network"])]
    pub zenoh_config: Option<PathBuf>,
    /// Middleware of those who call services over DDS
    #[arg(long, value_enum, default_value_t = Rmw::Fastrtps)]
    pub rmw: Rmw,
    /// Domain of ROS
    #[arg(long, value_name = "ID", env = "ROS_DOMAIN_ID", default_value_t = 0)]
    #[arg(value_parser = clap::value_parser!(u16).range(0..=i64::from(MAX_DOMAIN_ID)))]
    #[serde(deserialize_with = "domain_id_of")]
    pub domain_id: u16,
    /// Talk to other machines too; without it, the loopback interface alone is used
    #[arg(long)]
    pub network: bool,
}

/// What stamps can be apart: some hundred years.
const MAX_S: f64 = 9e9;
/// Farther than a map reaches.
const MAX_M: f64 = 1e9;
/// Of DDS, whose ports follow from it.
const MAX_DOMAIN_ID: u16 = 232;

fn seconds(text: &str) -> Result<Duration, String> {
    within(text.parse().ok(), MAX_S, "seconds").map(Duration::from_secs_f64)
}

fn metres(text: &str) -> Result<f64, String> {
    within(text.parse().ok(), MAX_M, "metres")
}

/// A number that is not below zero, and no more than this.
fn within(number: Option<f64>, most: f64, unit: &str) -> Result<f64, String> {
    let number = number.filter(|number| (0.0..=most).contains(number));
    number.ok_or_else(|| format!("give {unit}, from 0 to {most}"))
}

fn seconds_of<'de, D: Deserializer<'de>>(parameter: D) -> Result<Duration, D::Error> {
    let number = within(Some(f64::deserialize(parameter)?), MAX_S, "seconds");
    number.map(Duration::from_secs_f64).map_err(serde::de::Error::custom)
}

fn as_seconds<S: Serializer>(time: &Duration, serializer: S) -> Result<S::Ok, S::Error> {
    time.as_secs_f64().serialize(serializer)
}

/// In full: by itself it would be rounded to a text.
fn as_bytes<S: Serializer>(size: &ByteSize, serializer: S) -> Result<S::Ok, S::Error> {
    size.as_u64().serialize(serializer)
}

fn metres_of<'de, D: Deserializer<'de>>(parameter: D) -> Result<f64, D::Error> {
    within(Some(f64::deserialize(parameter)?), MAX_M, "metres").map_err(serde::de::Error::custom)
}

fn domain_id_of<'de, D: Deserializer<'de>>(parameter: D) -> Result<u16, D::Error> {
    let id = u16::deserialize(parameter)?;
    let too_large = || serde::de::Error::custom(format!("give a domain from 0 to {MAX_DOMAIN_ID}"));
    (id <= MAX_DOMAIN_ID).then_some(id).ok_or_else(too_large)
}

/// A text, or a list of them.
fn one_or_more<'de, D: Deserializer<'de>>(parameter: D) -> Result<Vec<String>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "expected a text or a list of texts")]
    enum Texts {
        One(String),
        More(Vec<String>),
    }
    match Texts::deserialize(parameter)? {
        Texts::One(text) => Ok(vec![text]),
        Texts::More(texts) if texts.is_empty() => Err(serde::de::Error::custom("give at least one")),
        Texts::More(texts) => Ok(texts),
    }
}

impl Args {
    /// Bytes of clouds that may wait.
    pub fn queue_bytes(&self) -> usize {
        self.memory_bytes() / 8
    }

    /// Bytes of the mapper.
    pub fn map_bytes(&self) -> usize {
        self.memory_bytes() - self.queue_bytes() - self.remapping_bytes()
    }

    /// Bytes of what maps the map again beside the mapper.
    pub fn remapping_bytes(&self) -> usize {
        if self.path.is_some() { self.memory_bytes() / 4 } else { 0 }
    }

    /// Names of the node, of topics and of services.
    ///
    /// # Errors
    ///
    /// Rules that are none.
    pub fn names(&self) -> anyhow::Result<Names> {
        Names::new(&self.namespace, &self.node_name, &self.remap)
    }

    /// How hits and misses become evidence, in a new map.
    ///
    /// # Errors
    ///
    /// Probabilities that make no model.
    pub fn sensor_model(&self) -> voxtile::Result<SensorModel> {
        let octomap = LogOdds::default();
        let given = LogOdds::from_probabilities(
            self.hit.unwrap_or(0.7),
            self.miss.unwrap_or(0.4),
            self.clamp_min.unwrap_or(0.1192),
            self.clamp_max.unwrap_or(0.971),
        )?;
        // OctoMap's defaults are not quite these probabilities.
        let model = LogOdds {
            hit: self.hit.map_or(octomap.hit, |_| given.hit),
            miss: self.miss.map_or(octomap.miss, |_| given.miss),
            min: self.clamp_min.map_or(octomap.min, |_| given.min),
            max: self.clamp_max.map_or(octomap.max, |_| given.max),
        };
        Ok(SensorModel::LogOdds(model))
    }

    /// How the local map is made beside a map.
    ///
    /// # Errors
    ///
    /// Lengths that are none; a radius of more voxels than the local map inflates by.
    pub fn local_parameters(&self, map: &MapConfig) -> voxtile::Result<LocalParameters> {
        let resolution_m = map.grid.resolution_m();
        let radius_m = self.inflation_radius.unwrap_or(DEFAULT_INFLATION_M.min(20.0 * resolution_m));
        let mut parameters = LocalParameters::local_mapping()
            .with_max_voxels(self.local_max_voxels)
            .with_ranges(self.local_range, self.inflation_range)
            .with_inflation_radius(radius_m);
        parameters.min_input_range_m = self.min_range;
        parameters.validated(resolution_m)
    }

    /// How much is published.
    ///
    /// # Errors
    ///
    /// Lengths that are none.
    pub fn extent(&self) -> anyhow::Result<Extent> {
        let radius_m = self.publish_radius;
        ensure!(radius_m > 0.0, "--publish-radius: {radius_m} is no radius; give metres above 0");
        let heights_m = [
            self.occupancy_min_z.unwrap_or(f64::NEG_INFINITY),
            self.occupancy_max_z.unwrap_or(f64::INFINITY),
        ];
        let [least, most] = heights_m;
        ensure!(least < most, "--occupancy-min-z: {least} is not below --occupancy-max-z, {most}");
        Ok(Extent { radius_m, heights_m })
    }

    /// How much is published of the flat map.
    ///
    /// # Errors
    ///
    /// Lengths that are none.
    pub fn projected_extent(&self) -> anyhow::Result<Extent> {
        let extent = self.extent()?;
        let radius_m = self.projected_radius.unwrap_or(extent.radius_m);
        ensure!(radius_m > 0.0, "--projected-radius: {radius_m} is no radius; give metres above 0");
        Ok(Extent { radius_m, ..extent })
    }

    /// # Errors
    ///
    /// A time that is none.
    pub fn publish_every(&self) -> anyhow::Result<Duration> {
        Duration::try_from_secs_f64(self.publish_every)
            .map_err(|_| anyhow::anyhow!("--publish-every: {} is no time; give seconds", self.publish_every))
    }

    fn memory_bytes(&self) -> usize {
        usize::try_from(self.memory.as_u64()).unwrap_or(usize::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_local_map_fits_the_voxels() {
        let parameters = |options: &[&str], resolution_m: f64| {
            let args = Args::parse_from(["voxtile-ros2", "-o", "map"].iter().chain(options));
            args.local_parameters(&MapConfig::new(resolution_m, 64.0 * resolution_m).unwrap())
        };
        assert_eq!(parameters(&[], 0.1).unwrap(), LocalParameters::local_mapping());
        assert_eq!(parameters(&[], 0.005).unwrap().inflation_radius_m, 0.1);
        let given = parameters(&["--min-range", "0.5", "--inflation-radius", "0.3"], 0.1).unwrap();
        assert_eq!((given.min_input_range_m, given.inflation_radius_m), (0.5, 0.3));
        for wrong in [["--inflation-radius", "3"], ["--local-max-voxels", "0"], ["--inflation-range", "NaN"]]
        {
            assert!(parameters(&wrong, 0.1).is_err(), "{wrong:?}");
        }
    }
}
