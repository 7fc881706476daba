use crate::clearing_rule::ClearingRule;
use crate::distances::Distances;
use crate::frontiers::Frontiers;
use crate::ground_filter::GroundFilter;
use crate::layer_list::LayerList;
use crate::listen_address::ListenAddress;
use crate::log_format::LogFormat;
use crate::names::Names;
use crate::point_limits::PointLimits;
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

pub const DEFAULT_NODE_NAME: &str = "voxtile_ros2";
const DEFAULT_INFLATION_M: f64 = 0.2;

/// ROS 2 node that maps point clouds into a voxtile map. Lengths are in metres, times in seconds.
// clap reads these fields as options, serde reads them as ROS parameters: names, types and limits are the same.
#[derive(Clone, Debug, Parser, Serialize, Deserialize)]
#[command(name = "voxtile-ros2", version, max_term_width = 80, args_override_self = true)]
#[command(
    after_help = "`voxtile-ros2 health [ADDRESS:]PORT` checks a node that runs with --metrics, by its exit code."
)]
pub struct Args {
    /// Map folder; created if missing, continued if it exists
    #[arg(short = 'o', long = "output", value_name = "MAP")]
    #[serde(skip_serializing, default)]
    pub output: PathBuf,
    /// ROS 2 parameter file; command-line options override it, and later files override earlier ones
    #[arg(long, value_name = "FILE")]
    #[serde(skip_serializing, default)]
    pub params_file: Vec<PathBuf>,
    /// Start a new map from this OctoMap file (.bt .ot), with its resolution
    #[arg(long, value_name = "FILE")]
    #[serde(skip_serializing, default)]
    pub octomap_path: Option<PathBuf>,
    /// Topic of clouds (sensor_msgs/PointCloud2); repeat it for each sensor
    #[arg(long, value_name = "TOPIC", default_value = "cloud_in")]
    #[serde(deserialize_with = "one_or_more")]
    pub cloud: Vec<String>,
    /// Frame of the map
    #[arg(long, value_name = "FRAME", default_value = "map")]
    pub frame_id: String,
    /// Take poses from this nav_msgs/Odometry topic instead of /tf; sensor mounts still come from /tf_static
    #[arg(long, value_name = "TOPIC")]
    pub odometry: Option<String>,
    /// Topic (nav_msgs/Path) of corrected sensor poses at the stamps of clouds. Replays the clouds that moved, while
    /// mapping continues. Implies --keep-scans; requires a single cloud topic
    #[arg(long, value_name = "TOPIC")]
    pub path: Option<String>,
    /// Ignore a path that moves no scan by more than this and turns none by more than half a degree
    #[arg(long, value_name = "M", default_value_t = 0.05, value_parser = metres, allow_negative_numbers = true)]
    #[serde(deserialize_with = "metres_of")]
    pub path_tolerance: f64,
    /// Drop a cloud if the transforms around its stamp do not arrive within this time
    #[arg(long, value_name = "S", default_value = "1", value_parser = seconds, allow_negative_numbers = true)]
    #[serde(serialize_with = "as_seconds", deserialize_with = "seconds_of")]
    pub transform_wait: Duration,
    /// Maximum time from a cloud to the nearer of the two transforms around its stamp; gaps of up to twice this time
    /// are interpolated
    #[arg(long, value_name = "S", default_value = "0.5", value_parser = seconds, allow_negative_numbers = true)]
    #[serde(serialize_with = "as_seconds", deserialize_with = "seconds_of")]
    pub pose_tolerance: Duration,
    /// Correct points for the motion of the sensor during a cloud, by the times of points in its fields. A cloud waits for
    /// transforms up to its last point
    #[arg(long)]
    pub deskew: bool,

    /// Voxel size of a new map
    #[arg(long, value_name = "M", default_value_t = 0.05)]
    pub resolution: f64,
    /// Tile size of a new map [default: the multiple of the resolution nearest to 10]
    #[arg(long, value_name = "M")]
    pub tile_size: Option<f64>,
    /// Ignore points nearer than this
    #[arg(long, value_name = "M", default_value_t = 0.0)]
    pub min_range: f64,
    /// Cut rays at this length
    #[arg(long, value_name = "M")]
    pub max_range: Option<f64>,
    /// Ignore points with a smaller x in the map frame, with --filter-ground-plane in the base frame: neither hits nor
    /// free space
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub point_cloud_min_x: Option<f64>,
    /// Ignore points with a larger x in the map frame
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub point_cloud_max_x: Option<f64>,
    /// Ignore points with a smaller y in the map frame
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub point_cloud_min_y: Option<f64>,
    /// Ignore points with a larger y in the map frame
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub point_cloud_max_y: Option<f64>,
    /// Ignore points with a smaller z in the map frame
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub point_cloud_min_z: Option<f64>,
    /// Ignore points with a larger z in the map frame
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub point_cloud_max_z: Option<f64>,
    /// Points of the ground clear space, but are no obstacles. The ground is a level plane near z = 0 of the base frame
    #[arg(long)]
    pub filter_ground_plane: bool,
    /// Frame of the ground filter
    #[arg(long, value_name = "FRAME", default_value = "base_footprint")]
    pub base_frame_id: String,
    /// Largest distance of ground points from their plane
    #[arg(long, value_name = "M", default_value_t = 0.04)]
    pub ground_filter_distance: f64,
    /// Largest angle between the plane of the ground and the horizontal, in radians
    #[arg(long, value_name = "RAD", default_value_t = 0.15)]
    pub ground_filter_angle: f64,
    /// Largest distance of the plane of the ground from the origin of the base frame
    #[arg(long, value_name = "M", default_value_t = 0.07)]
    pub ground_filter_plane_distance: f64,
    /// Layers of a new map, from fields of clouds: colour,intensity=MAX,class,time,shape
    #[arg(long, value_name = "LAYERS")]
    pub layers: Option<LayerList>,
    /// Occupancy probability of a hit, for a new map [default: 0.7]
    #[arg(long, value_name = "P")]
    pub hit: Option<f64>,
    /// Occupancy probability of a miss, for a new map [default: 0.4]
    #[arg(long, value_name = "P")]
    pub miss: Option<f64>,
    /// Minimum occupancy probability of a voxel, for a new map [default: 0.1192]
    #[arg(long, value_name = "P")]
    pub clamp_min: Option<f64>,
    /// Maximum occupancy probability of a voxel, for a new map [default: 0.971]
    #[arg(long, value_name = "P")]
    pub clamp_max: Option<f64>,
    /// Rule that selects which misses of a scan clear known voxels, for a new map [default: octomap]
    #[arg(long, value_name = "RULE")]
    pub clearing: Option<ClearingRule>,
    /// Keep the scans in a new map, so that it can follow corrected trajectories
    #[arg(long)]
    pub keep_scans: bool,
    /// Memory for the map and queued clouds; an eighth is for clouds, and with --path a quarter for remapping
    #[arg(long, value_name = "SIZE", default_value = "1GiB")]
    #[serde(serialize_with = "as_bytes")]
    pub memory: ByteSize,
    /// Interval between flushes
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    pub flush_every: f64,
    /// Action if clouds arrive faster than they are mapped
    #[arg(long, value_enum, default_value_t = WhenBehind::DropOldest)]
    pub when_behind: WhenBehind,

    /// Interval between publications of changes; topics without subscribers are skipped
    #[arg(long, value_name = "S", default_value_t = 1.0)]
    pub publish_every: f64,
    /// Publish the box around the sensor up to this distance
    #[arg(long, value_name = "M", default_value_t = 20.0)]
    pub publish_radius: f64,
    /// Distance to which projected_map is published [default: --publish-radius]
    #[arg(long, value_name = "M")]
    pub projected_radius: Option<f64>,
    /// Omit voxels below this height from clouds, cubes and projected_map
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub occupancy_min_z: Option<f64>,
    /// Omit voxels above this height from clouds, cubes and projected_map
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub occupancy_max_z: Option<f64>,

    /// Ignore points beyond this distance from the sensor in the local map
    #[arg(long, value_name = "M", default_value_t = 40.0)]
    pub local_range: f64,
    /// Maximum number of voxels in the local map; the least recently seen are dropped first
    #[arg(long, value_name = "N", default_value_t = 50_000)]
    pub local_max_voxels: usize,
    /// Inflate occupied voxels by this radius [default: 0.2, at most 20 voxels]
    #[arg(long, value_name = "M")]
    pub inflation_radius: Option<f64>,
    /// Inflate only occupied voxels within this distance of the sensor
    #[arg(long, value_name = "M", default_value_t = 8.0)]
    pub inflation_range: f64,

    /// Cap of the distances to the nearest obstacle (topic distance_field, service get_esdf_and_gradient)
    #[arg(long, value_name = "M", default_value_t = 2.0)]
    pub distance_max: f64,
    /// Publish distances up to this horizontal distance from the sensor
    #[arg(long, value_name = "M", default_value_t = 5.0)]
    pub distance_radius: f64,
    /// Publish distances up to this height above and below the sensor
    #[arg(long, value_name = "M", default_value_t = 1.0)]
    pub distance_height: f64,
    /// Interval between publications of distances; without subscribers they are not computed
    #[arg(long, value_name = "S", default_value_t = 0.2)]
    pub distance_every: f64,

    /// Publish the frontiers around the sensor (topics frontiers, frontier_goals)
    #[arg(long)]
    pub frontiers: bool,
    /// Publish frontiers up to this horizontal distance from the sensor
    #[arg(long, value_name = "M", default_value_t = 10.0)]
    pub frontier_radius: f64,
    /// Publish frontiers up to this height above and below the sensor
    #[arg(long, value_name = "M", default_value_t = 2.0)]
    pub frontier_height: f64,
    /// Omit frontiers with less area, in square metres
    #[arg(long, value_name = "M2", default_value_t = 0.5)]
    pub frontier_min_area: f64,
    /// Interval between publications of frontiers; without subscribers they are not computed
    #[arg(long, value_name = "S", default_value_t = 1.0)]
    pub frontier_every: f64,

    /// Name of the node; also the prefix of some service names
    #[arg(long, value_name = "NAME", default_value = DEFAULT_NODE_NAME)]
    pub node_name: String,
    /// Namespace of the node, prefixed to relative names
    #[arg(long, value_name = "NS", default_value = "/")]
    pub namespace: String,
    /// Rename a topic or service; repeat it for each
    #[arg(long, value_name = "FROM:=TO")]
    pub remap: Vec<String>,
    /// Transport of messages: DDS, or Zenoh compatible with rmw_zenoh_cpp
    #[arg(long, value_enum, default_value_t = TransportName::Dds)]
    pub transport: TransportName,
    /// Zenoh router; repeat it for each
    #[arg(long, value_name = "ENDPOINT", default_value = "tcp/localhost:7447")]
    #[serde(deserialize_with = "one_or_more")]
    pub zenoh_router: Vec<String>,
    /// Zenoh configuration file (JSON5), instead of --zenoh-router and --network
    #[arg(long, value_name = "FILE", conflicts_with_all = ["zenoh_router", "network"])]
    #[serde(skip_serializing, default)]
    pub zenoh_config: Option<PathBuf>,
    /// RMW implementation of service clients over DDS
    #[arg(long, value_enum, default_value_t = Rmw::Fastrtps)]
    pub rmw: Rmw,
    /// ROS domain ID
    #[arg(long, value_name = "ID", env = "ROS_DOMAIN_ID", default_value_t = 0)]
    #[arg(value_parser = clap::value_parser!(u16).range(0..=i64::from(MAX_DOMAIN_ID)))]
    #[serde(deserialize_with = "domain_id_of")]
    pub domain_id: u16,
    /// Communicate with other machines; otherwise only over the loopback interface
    #[arg(long)]
    pub network: bool,

    /// Serve /metrics (Prometheus) and /health over HTTP. A port alone is on the loopback interface
    #[arg(long, value_name = "[ADDRESS:]PORT")]
    pub metrics: Option<ListenAddress>,
    /// Format of the log on standard error
    #[arg(long, value_enum, default_value_t = LogFormat::Text)]
    pub log_format: LogFormat,
    /// Log each dropped cloud; -vv also logs waiting clouds and each tile read or written. RUST_LOG sets the level by
    /// module
    #[arg(short, long, action = clap::ArgAction::Count)]
    pub verbose: u8,
}

/// Upper bound on durations, in seconds: almost 300 years, which fits nanoseconds in an `i64`.
const MAX_S: f64 = 9e9;
/// Upper bound on lengths, larger than any map.
const MAX_M: f64 = 1e9;
/// Highest domain ID whose DDS ports are valid.
const MAX_DOMAIN_ID: u16 = 232;

fn seconds(text: &str) -> Result<Duration, String> {
    within(text.parse().ok(), MAX_S, "seconds").map(Duration::from_secs_f64)
}

fn metres(text: &str) -> Result<f64, String> {
    within(text.parse().ok(), MAX_M, "metres")
}

/// Checks that a number is in `0..=most`.
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

/// Serializes a size as an exact integer; `ByteSize` itself would serialize as a rounded text.
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

/// Deserializes a string or a list of strings.
fn one_or_more<'de, D: Deserializer<'de>>(parameter: D) -> Result<Vec<String>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "expected a string or a list of strings")]
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
    pub fn queue_bytes(&self) -> usize {
        self.memory_bytes() / 8
    }

    pub fn map_bytes(&self) -> usize {
        self.memory_bytes() - self.queue_bytes() - self.remapping_bytes()
    }

    /// Returns the memory for the thread that remaps by corrected paths, in bytes.
    pub fn remapping_bytes(&self) -> usize {
        if self.path.is_some() { self.memory_bytes() / 4 } else { 0 }
    }

    /// Returns the names of the node, its topics and services.
    ///
    /// # Errors
    ///
    /// Invalid names or remapping rules.
    pub fn names(&self) -> anyhow::Result<Names> {
        Names::new(&self.namespace, &self.node_name, &self.remap)
    }

    /// Returns the absolute names of the topics of clouds. Invalid names are returned as given.
    pub fn cloud_topics(&self) -> Vec<String> {
        let names = self.names().ok();
        let full = |topic: &String| names.as_ref().map_or_else(|| topic.clone(), |names| names.full(topic));
        self.cloud.iter().map(full).collect()
    }

    /// Returns the sensor model of a new map.
    ///
    /// # Errors
    ///
    /// Probabilities that form no valid model.
    pub fn sensor_model(&self) -> voxtile::Result<SensorModel> {
        let octomap = LogOdds::default();
        let given = LogOdds::from_probabilities(
            self.hit.unwrap_or(0.7),
            self.miss.unwrap_or(0.4),
            self.clamp_min.unwrap_or(0.1192),
            self.clamp_max.unwrap_or(0.971),
        )?;
        // OctoMap's log-odds defaults differ slightly from these probabilities, so keep its values unless an option is
        // given.
        let model = LogOdds {
            hit: self.hit.map_or(octomap.hit, |_| given.hit),
            miss: self.miss.map_or(octomap.miss, |_| given.miss),
            min: self.clamp_min.map_or(octomap.min, |_| given.min),
            max: self.clamp_max.map_or(octomap.max, |_| given.max),
        };
        Ok(SensorModel::LogOdds(model))
    }

    /// Returns the parameters of the local map.
    ///
    /// # Errors
    ///
    /// Invalid lengths, or a radius beyond the maximum number of voxels.
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

    /// Returns the published region.
    ///
    /// # Errors
    ///
    /// Invalid lengths.
    pub fn extent(&self) -> anyhow::Result<Extent> {
        let radius_m = self.publish_radius;
        ensure!(radius_m > 0.0, "--publish-radius: {radius_m} is not a valid radius; give metres above 0");
        let heights_m = [
            self.occupancy_min_z.unwrap_or(f64::NEG_INFINITY),
            self.occupancy_max_z.unwrap_or(f64::INFINITY),
        ];
        let [least, most] = heights_m;
        ensure!(least < most, "--occupancy-min-z: {least} must be below --occupancy-max-z ({most})");
        Ok(Extent { radius_m, heights_m })
    }

    /// Returns the region of `projected_map`.
    ///
    /// # Errors
    ///
    /// Invalid lengths.
    pub fn projected_extent(&self) -> anyhow::Result<Extent> {
        let extent = self.extent()?;
        let radius_m = self.projected_radius.unwrap_or(extent.radius_m);
        ensure!(radius_m > 0.0, "--projected-radius: {radius_m} is not a valid radius; give metres above 0");
        Ok(Extent { radius_m, ..extent })
    }

    /// Returns the parameters of the distance field.
    ///
    /// # Errors
    ///
    /// Invalid lengths or an invalid duration.
    pub fn distances(&self) -> anyhow::Result<Distances> {
        Distances::new(self.distance_every, self.distance_max, self.distance_radius, self.distance_height)
    }

    /// Returns the parameters of the frontiers, if they are published.
    ///
    /// # Errors
    ///
    /// Invalid lengths, an invalid area or an invalid duration.
    pub fn frontiers(&self) -> anyhow::Result<Option<Frontiers>> {
        let frontiers = Frontiers::new(
            self.frontier_every,
            self.frontier_min_area,
            self.frontier_radius,
            self.frontier_height,
        )?;
        Ok(self.frontiers.then_some(frontiers))
    }

    /// Returns the box outside of which points are ignored, in the map frame.
    ///
    /// # Errors
    ///
    /// A minimum that is not below the maximum.
    pub fn point_limits(&self) -> anyhow::Result<PointLimits> {
        let limits = [
            ("x", self.point_cloud_min_x, self.point_cloud_max_x),
            ("y", self.point_cloud_min_y, self.point_cloud_max_y),
            ("z", self.point_cloud_min_z, self.point_cloud_max_z),
        ];
        let mut box_m = [[0.0; 2]; 3];
        for ((axis, min, max), limits_m) in limits.into_iter().zip(&mut box_m) {
            let (min, max) = (min.unwrap_or(f64::NEG_INFINITY), max.unwrap_or(f64::INFINITY));
            ensure!(
                min < max,
                "--point-cloud-min-{axis}: {min} must be below --point-cloud-max-{axis} ({max})"
            );
            *limits_m = [min, max];
        }
        Ok(PointLimits(box_m))
    }

    /// Returns the ground filter, if there is one.
    ///
    /// # Errors
    ///
    /// Invalid lengths or an invalid angle.
    pub fn ground_filter(&self) -> anyhow::Result<Option<GroundFilter>> {
        for (option, value) in [
            ("distance", self.ground_filter_distance),
            ("angle", self.ground_filter_angle),
            ("plane-distance", self.ground_filter_plane_distance),
        ] {
            ensure!(value > 0.0, "--ground-filter-{option}: {value} is not valid; give a number above 0");
        }
        Ok(self.filter_ground_plane.then_some(GroundFilter {
            distance_m: self.ground_filter_distance,
            angle_rad: self.ground_filter_angle,
            plane_distance_m: self.ground_filter_plane_distance,
        }))
    }

    /// Returns the interval between publications.
    ///
    /// # Errors
    ///
    /// An invalid duration.
    pub fn publish_every(&self) -> anyhow::Result<Duration> {
        Duration::try_from_secs_f64(self.publish_every).map_err(|_| {
            anyhow::anyhow!("--publish-every: {} is not a valid duration; give seconds", self.publish_every)
        })
    }

    fn memory_bytes(&self) -> usize {
        usize::try_from(self.memory.as_u64()).unwrap_or(usize::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn local_parameters_depend_on_the_voxel_size() {
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
