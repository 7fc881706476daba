use super::bag_options::{BagOptions, PoseSource};
use super::bag_topic::{choose_poses, kind_of};
use super::messages::{MessageKind, visit_poses};
use super::pose_hint::topics_with_poses;
use super::pose_lookup::PoseLookup;
use super::pose_track::PoseTrack;
use super::recording::{Recording, Topic};
use super::sample_spool::SampleSpool;
use super::transform_collector::{TransformCollector, remark_on};
use super::transforms::{Transforms, WhyNot};
use super::unstamped::Unstamped;
use crate::poses::RigidPose;
use crate::spill::Budget;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;
use voxtile::{Error, Result};

/// Sensor poses at the stamps of clouds.
#[derive(Debug)]
pub(super) struct BagPoses {
    source: PoseSource,
    /// Shared with the pose lookups used while clouds are read.
    transforms: Arc<Transforms>,
    fixed_frame: Option<String>,
    /// Poses of a topic, until they are added to `transforms`.
    track: PoseTrack,
    /// Child frame of the poses of a topic, once they are in `transforms`.
    body: Option<String>,
    /// For registered clouds: their frame, which is the map frame, and the sensor's frame.
    registered: Option<(String, String)>,
    is_world_frame: bool,
    are_poses_needed: bool,
    /// Topic of poses from the options.
    odometry_topic: Option<String>,
    /// Whether any cloud had a pose.
    has_placed: bool,
    /// Advice to report if no cloud has a pose.
    hints: Vec<String>,
    /// Pose lookups by sensor frame.
    lookups: HashMap<String, std::result::Result<PoseLookup, WhyNot>>,
    /// Number of clouds without a pose, by reason.
    without: BTreeMap<String, u64>,
    remarks: Vec<String>,
}

/// Pose of a cloud.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    pub(super) world_from_sensor: RigidPose,
    /// Whether the points are already in the map frame.
    pub(super) is_in_world: bool,
}

/// Words in names of fixed frames.
const MAP_NAMES: [&str; 6] = ["map", "odom", "world", "camera_init", "global", "earth"];
/// Words in names of sensor and robot frames.
const BODY_NAMES: [&str; 14] = [
    "base", "body", "camera", "imu", "laser", "lidar", "livox", "mapped", "os_", "ouster", "robot", "sensor",
    "vehicle", "velodyne",
];
/// Child frame of poses that name none, if the frame that would be assumed is already the parent frame.
const UNNAMED_BODY: &str = "(unnamed)";
/// Memory per sample, in bytes.
const SAMPLE_BYTES: usize = 96;
/// Limit for cached lookups. A topic usually has few sensor frames; further lookups are created each time.
const MAX_LOOKUPS: usize = 32;
/// Limit for the reasons to count for clouds without a pose.
const MAX_REASONS: usize = 100;
/// Robot base frames, used if a pose does not name its child frame.
const BASE_FRAMES: [&str; 2] = ["base_link", "base_footprint"];
impl BagPoses {
    /// Reads all transforms, and the poses of a topic if requested.
    pub(super) fn read(recording: &mut dyn Recording, options: &BagOptions) -> Result<Self> {
        let mut poses = Self {
            source: options.poses,
            transforms: Arc::default(),
            fixed_frame: options.fixed_frame.as_ref().map(|frame| frame.trim_start_matches('/').to_owned()),
            track: PoseTrack::default(),
            body: None,
            registered: None,
            is_world_frame: options.is_world_frame,
            are_poses_needed: options.are_poses_needed,
            odometry_topic: None,
            has_placed: false,
            hints: Vec::new(),
            lookups: HashMap::new(),
            without: BTreeMap::new(),
            remarks: Vec::new(),
        };
        if options.poses == PoseSource::None {
            return Ok(poses);
        }
        Arc::make_mut(&mut poses.transforms).set_most_gap_ns(options.most_gap_ns);
        let topics = recording.topics().to_vec();
        let is_tf = |index: &usize| topics.get(*index).and_then(kind_of) == Some(MessageKind::Tf);
        let mut wanted: Vec<usize> = (0..topics.len()).filter(is_tf).collect();
        let odometry = match options.poses {
            PoseSource::Odometry => Some(choose_poses(&topics, options.odometry_topic.as_deref())?),
            _ => None,
        };
        wanted.extend(odometry);
        poses.odometry_topic = odometry.and_then(|index| topics.get(index)).map(|topic| topic.name.clone());
        if odometry.is_none() {
            poses.hints.extend(topics_with_poses(&topics));
        }
        poses.read_topics(recording, &topics, &wanted, odometry, &options.budget())?;
        match odometry.and_then(|index| topics.get(index)) {
            Some(topic) if poses.track.poses.is_empty() => Err(poses.without_track(topic)),
            _ => Ok(poses),
        }
    }

    /// Returns the error for a pose topic without valid poses. There is no fallback to `/tf`, because the user selected
    /// the topic.
    fn without_track(&self, topic: &Topic) -> Error {
        let (messages, odd) = (topic.messages, self.track.odd);
        let unusable = match odd {
            0 => String::new(),
            odd => format!("; {odd} are invalid or have unnamed frames"),
        };
        let bad = self.remarks.first().map(|bad| format!("; {bad}")).unwrap_or_default();
        let reason = format!(
            "none of its {messages} messages contains a valid pose{unusable}{bad}; choose another topic, omit the \
             option to use /tf, or give a file with `poses`"
        );
        Error::argument(format!("odometry {}", topic.name), reason)
    }

    fn read_topics(
        &mut self,
        recording: &mut dyn Recording,
        topics: &[Topic],
        wanted: &[usize],
        odometry: Option<usize>,
        budget: &Budget,
    ) -> Result<()> {
        let (mut bad, mut first_bad) = (0_u64, None);
        let mut note = |what: String| {
            bad += 1;
            first_bad.get_or_insert(what);
        };
        let (mut intake, share) = (TransformCollector::default(), budget.bytes / 2);
        let (mut unstamped, mut unstamped_track) = (Unstamped::default(), Unstamped::default());
        let (mut in_memory, mut spool) = (0, None);
        let (transforms, track) = (Arc::make_mut(&mut self.transforms), &mut self.track);
        recording.begin(wanted)?;
        loop {
            if in_memory > share / SAMPLE_BYTES {
                let spool = spool.get_or_insert_with(|| SampleSpool::new(budget, share));
                spool.take(transforms.samples_mut().chain([&mut track.poses]))?;
                in_memory = 0;
            }
            let mut message = match recording.next_message() {
                Ok(Some(message)) => message,
                Ok(None) => break,
                // A damaged part costs a few poses. An I/O error, such as a full disk, could cost all, so it ends the
                // read.
                Err(error @ Error::Io { .. }) => return Err(error),
                Err(error) => {
                    note(format!("{error:#}"));
                    continue;
                }
            };
            let topic = topics.get(message.topic);
            let Some((topic, kind, wire)) =
                topic.and_then(|topic| Some((topic, kind_of(topic)?, topic.wire?)))
            else {
                continue;
            };
            let data = match message.data.load(budget.whole_bytes()) {
                Ok(data) => data,
                Err(error @ Error::Io { .. }) => return Err(error),
                Err(error) => {
                    note(format!("{}: {error:#}", topic.name));
                    continue;
                }
            };
            let is_track = Some(message.topic) == odometry;
            let is_static = topic.name.ends_with("tf_static");
            let log_ns = message.log_ns;
            let decoded = visit_poses(kind, wire, data, &mut |pose| {
                in_memory += 1;
                match (is_track, is_static) {
                    (true, _) => unstamped_track.sort(pose, log_ns, &mut |pose| track.insert(pose)),
                    (false, true) => intake.take(transforms, pose, true),
                    _ => unstamped.sort(pose, log_ns, &mut |pose| intake.take(transforms, pose, false)),
                }
            });
            if let Err(error) = decoded {
                note(format!("{}: {error}", topic.name));
            }
        }
        unstamped_track.finish(&mut |pose| track.insert(pose));
        unstamped.finish(&mut |pose| intake.take(transforms, pose, false));
        if let Some(spool) = spool {
            spool.finish(transforms.samples_mut().chain([&mut track.poses]))?;
        }
        if let Some(first) = first_bad {
            self.remarks
                .push(format!("{bad} messages or chunks with poses cannot be read; the first: {first}"));
        }
        self.remarks.extend(intake.remarks());
        let count = unstamped.count + unstamped_track.count;
        if count > 0 {
            self.remarks.push(format!("{count} poses have no stamp; their recording times are used"));
        }
        Ok(())
    }

    /// Returns whether the pose of a frame in the map is known from moving transforms.
    pub(super) fn places(&self, frame: &str) -> bool {
        let fixed = self.fixed_frame.clone().map_or_else(|| self.fixed_frame_of(frame), Ok);
        fixed.is_ok_and(|fixed| fixed != frame)
    }

    pub(super) fn moves(&self, frame: &str) -> bool {
        self.transforms.ancestors(frame).iter().any(|frame| self.transforms.is_moving(frame))
    }

    /// Returns whether any frame moves relative to this one.
    pub(super) fn moves_below(&self, frame: &str) -> bool {
        !self.transforms.moving_below(frame).is_empty()
    }

    /// Treats clouds in this frame as registered in the map, with the rays starting at a frame that moves in it.
    /// Returns `false` if the frame is not named like a map, or if no unique robot frame moves in it.
    pub(super) fn see_from_below(&mut self, frame: &str) -> bool {
        let is_like =
            |frame: &str, names: &[&str]| names.iter().any(|name| frame.to_lowercase().contains(name));
        // Require the name of a map, because wheels and arms also move relative to a robot's frame.
        if !is_like(frame, &MAP_NAMES) {
            return false;
        }
        let moving = self.transforms.moving_below(frame);
        let last: Vec<&String> =
            moving.iter().filter(|(_, is_last)| *is_last).map(|(name, _)| name).collect();
        let base =
            BASE_FRAMES.iter().find_map(|base| moving.iter().map(|(name, _)| name).find(|name| name == base));
        let body = if let [only] = last[..] { Some(only) } else { base };
        // Require the name of a robot or sensor, because an arm may move in front of a fixed camera.
        let Some(body) = body.filter(|body| is_like(body, &BODY_NAMES)) else { return false };
        self.registered = Some((frame.to_owned(), body.clone()));
        self.fixed_frame = Some(frame.to_owned());
        true
    }

    /// Sets the advice to report if no cloud has a pose.
    pub(super) fn hint(&mut self, hint: String) {
        self.hints = vec![hint];
    }

    /// Returns the pose of a cloud. Counts the reason if there is none.
    pub(super) fn place(&mut self, cloud_frame: &str, stamp_ns: i64) -> Result<Option<Placed>> {
        if self.source == PoseSource::None {
            return Ok(None);
        }
        if self.source == PoseSource::Odometry && !self.track.poses.is_empty() {
            self.settle_track(cloud_frame);
        }
        let seen_from = self.seen_from(cloud_frame);
        let is_in_world = seen_from.is_some();
        match self.find(seen_from.as_deref().unwrap_or(cloud_frame), stamp_ns) {
            Ok(world_from_sensor) => {
                if let Some(body) = seen_from.filter(|_| self.registered.is_none()) {
                    self.registered = Some((cloud_frame.to_owned(), body));
                }
                self.has_placed = true;
                Ok(Some(Placed { world_from_sensor, is_in_world }))
            }
            Err(WhyNot::Unreadable(why)) => Err(Error::argument("poses of the recording", why)),
            Err(why) => {
                let mut why = why.to_string();
                if self.without.len() >= MAX_REASONS && !self.without.contains_key(&why) {
                    why = "other reasons".to_owned();
                }
                *self.without.entry(why).or_default() += 1;
                Ok(None)
            }
        }
    }

    /// Returns the sensor frame of clouds that are already in the map frame.
    fn seen_from(&self, cloud_frame: &str) -> Option<String> {
        if !self.are_poses_needed {
            return None;
        }
        if let Some((_, body)) = self.registered.as_ref().filter(|(frame, _)| frame == cloud_frame) {
            return Some(body.clone());
        }
        let body = self.body.as_deref().filter(|body| *body != cloud_frame)?;
        let is_fixed = self.fixed_frame.as_deref() == Some(cloud_frame);
        // For points in the world frame, only the sensor position is needed.
        let is_unknown = self.is_world_frame && !self.transforms.knows(cloud_frame);
        (is_fixed || is_unknown).then(|| body.to_owned())
    }

    fn find(&mut self, sensor_frame: &str, stamp_ns: i64) -> std::result::Result<RigidPose, WhyNot> {
        if !self.lookups.contains_key(sensor_frame) {
            if self.lookups.len() >= MAX_LOOKUPS {
                self.lookups.clear();
            }
            let lookup = self.new_lookup(sensor_frame);
            self.lookups.insert(sensor_frame.to_owned(), lookup);
        }
        self.lookup(sensor_frame)?.find(stamp_ns)
    }

    /// Returns a lookup of sensor poses at any time. Call it after the first [`BagPoses::place`], which adds the poses
    /// of a topic to the transforms.
    pub(super) fn lookup(&self, sensor_frame: &str) -> std::result::Result<PoseLookup, WhyNot> {
        let unknown = || Err(WhyNot::UnknownFrame(sensor_frame.to_owned()));
        self.lookups.get(sensor_frame).cloned().unwrap_or_else(unknown)
    }

    fn new_lookup(&self, sensor_frame: &str) -> std::result::Result<PoseLookup, WhyNot> {
        let fixed = match &self.fixed_frame {
            Some(frame) => frame.clone(),
            None => self.fixed_frame_of(sensor_frame)?,
        };
        if fixed == sensor_frame {
            return Err(WhyNot::AlreadyFixed(fixed));
        }
        PoseLookup::new(Arc::clone(&self.transforms), fixed, sensor_frame.to_owned())
    }

    /// Returns the default map frame above a sensor frame.
    fn fixed_frame_of(&self, sensor_frame: &str) -> std::result::Result<String, WhyNot> {
        if !self.transforms.knows(sensor_frame) {
            return Err(WhyNot::UnknownFrame(sensor_frame.to_owned()));
        }
        let chain = self.transforms.ancestors(sensor_frame);
        if let Some(known) =
            ["map", "odom"].into_iter().find(|known| chain.iter().any(|frame| frame == known))
        {
            return Ok(known.to_owned());
        }
        // A static mount alone does not give the robot's motion.
        if !chain.iter().any(|frame| self.transforms.is_moving(frame)) {
            return Err(WhyNot::NothingMoves(sensor_frame.to_owned()));
        }
        Ok(self.transforms.root_of(sensor_frame))
    }

    /// Adds the poses of a topic to the transforms, replacing those of the same frame.
    fn settle_track(&mut self, sensor_frame: &str) {
        let PoseTrack { parent, child: named, poses, mut odd } = std::mem::take(&mut self.track);
        let mut child = if named.is_empty() { self.base_of(sensor_frame) } else { named.clone() };
        if named.is_empty() && child == parent {
            child = UNNAMED_BODY.to_owned();
        }
        self.body = Some(child.clone());
        let transforms = Arc::make_mut(&mut self.transforms);
        transforms.detach(&child);
        if self.fixed_frame.is_none() {
            // Ancestors of the parent frame are irrelevant and might form a loop with its child.
            transforms.detach(&parent);
            self.fixed_frame = Some(parent.clone());
        }
        let count = poses.len() as u64;
        match transforms.attach(&parent, &child, poses) {
            Ok(_) => self.remarks.extend(transforms.second_parent(&parent, &child).map(remark_on)),
            Err(_) => odd += count,
        }
        if odd > 0 {
            let remark = format!(
                "{odd} poses are invalid or not of the frames {parent} and {child}, and were skipped"
            );
            self.remarks.push(remark);
        }
        if named.is_empty() && child != UNNAMED_BODY {
            self.remarks.push(format!("the poses do not name their child frame; {child} is assumed"));
        }
    }

    /// Returns the child frame of poses that do not name it: the base of the robot that carries the sensor, or the
    /// sensor.
    fn base_of(&self, sensor_frame: &str) -> String {
        let chain = self.transforms.ancestors(sensor_frame);
        let base = BASE_FRAMES.into_iter().find(|base| chain.iter().any(|frame| frame == base));
        base.unwrap_or(sensor_frame).to_owned()
    }

    /// Returns remarks for the user.
    pub(super) fn remarks(&self) -> impl Iterator<Item = String> + '_ {
        let without = self.without.iter().map(|(why, count)| format!("{count} clouds have no pose: {why}"));
        let is_without = !self.has_placed && !self.without.is_empty();
        let hints = self.hints.iter().filter(move |_| is_without).cloned();
        let registered = self.registered.as_ref().filter(|_| self.has_placed && !self.is_world_frame);
        let registered = registered.map(|(frame, body)| {
            let option = self.odometry_topic.as_ref();
            let option = option.map(|topic| format!(" (`odometry` {topic} `world_frame`)")).unwrap_or_default();
            format!("the clouds are already in the frame {frame}: their points are not transformed, and rays start at \
                     {body}{option}")
        });
        self.remarks.iter().cloned().chain(registered).chain(without).chain(hints)
    }
}
