use super::bag_options::{BagOptions, PoseSource};
use super::bag_topic::{choose_poses, kind_of};
use super::messages::{MessageKind, StampedPose, visit_poses};
use super::pose_lookup::PoseLookup;
use super::pose_track::PoseTrack;
use super::recording::{Recording, Topic};
use super::sample_spool::SampleSpool;
use super::second_parent::SecondParent;
use super::transforms::{Transforms, WhyNot};
use crate::poses::RigidPose;
use crate::spill::Budget;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;
use voxtile::{Error, Result};

/// Where the sensor was at the stamp of each cloud.
#[derive(Debug)]
pub(super) struct BagPoses {
    source: PoseSource,
    /// Shared with those who look poses up while clouds are read.
    transforms: Arc<Transforms>,
    fixed_frame: Option<String>,
    /// Poses of a topic, until they are among the transforms.
    track: PoseTrack,
    /// How the pose of a sensor is looked up, by its frame.
    lookups: HashMap<String, std::result::Result<PoseLookup, WhyNot>>,
    /// Number of clouds without a pose, by reason.
    without: BTreeMap<String, u64>,
    remarks: Vec<String>,
}

/// Memory that a sample takes.
const SAMPLE_BYTES: usize = 96;
/// Most pairs of a frame and its parent; a robot has a hundred.
const MAX_LINKS: usize = 10_000;
/// A longer name of a frame is damage.
const MAX_NAME_BYTES: usize = 256;
/// Most frames of sensors whose lookups are kept. A topic has few; those of more are made again.
const MAX_LOOKUPS: usize = 32;
/// Most reasons that are counted for clouds without a pose.
const MAX_REASONS: usize = 100;
/// The frames that a robot moves by, if a pose does not name its own.
const BASE_FRAMES: [&str; 2] = ["base_link", "base_footprint"];
/// Second parents of frames that are reported, and links among which they are looked for.
const MAX_SECONDS: usize = 8;
const MAX_CHECKED: usize = 2000;

impl BagPoses {
    /// Reads all transforms, and the poses of a topic if these are asked for.
    pub(super) fn read(recording: &mut dyn Recording, options: &BagOptions) -> Result<Self> {
        let mut poses = Self {
            source: options.poses,
            transforms: Arc::default(),
            fixed_frame: options.fixed_frame.as_ref().map(|frame| frame.trim_start_matches('/').to_owned()),
            track: PoseTrack::default(),
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
        poses.read_topics(recording, &topics, &wanted, odometry, &options.budget())?;
        match odometry.and_then(|index| topics.get(index)) {
            Some(topic) if poses.track.poses.is_empty() => Err(poses.without_track(topic)),
            _ => Ok(poses),
        }
    }

    /// Who asks for the poses of a topic does not want those of `/tf` in their place.
    fn without_track(&self, topic: &Topic) -> Error {
        let (messages, odd) = (topic.messages, self.track.odd);
        let unusable = match odd {
            0 => String::new(),
            odd => format!("; {odd} are not valid, or their frames have no name"),
        };
        let bad = self.remarks.first().map(|bad| format!("; {bad}")).unwrap_or_default();
        let reason = format!(
            "none of its {messages} messages gives a pose that can be used{unusable}{bad}; choose another topic, \
             leave the option out for /tf, or name a file with `poses`"
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
        let (mut bad, mut first_bad, mut beyond) = (0_u64, None, 0_u64);
        let mut note = |what: String| {
            bad += 1;
            first_bad.get_or_insert(what);
        };
        let (mut invalid, mut first_invalid) = (0_u64, None);
        let (mut checked, mut seconds): (usize, Vec<SecondParent>) = (0, Vec::new());
        let share = budget.bytes / 2;
        let (mut links, mut in_memory, mut spool) = (0_usize, 0, None);
        let transforms = Arc::make_mut(&mut self.transforms);
        recording.begin(wanted)?;
        loop {
            if in_memory > share / SAMPLE_BYTES {
                let spool = spool.get_or_insert_with(|| SampleSpool::new(budget, share));
                spool.take(transforms.samples_mut().chain([&mut self.track.poses]))?;
                in_memory = 0;
            }
            let mut message = match recording.next_message() {
                Ok(Some(message)) => message,
                Ok(None) => break,
                // Damage costs a few poses; a disk that is full, or fails, might cost all.
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
            let decoded = visit_poses(kind, wire, data, &mut |pose| {
                in_memory += 1;
                if is_track {
                    return self.track.insert(pose);
                }
                let StampedPose { header, child_frame, parent_from_child } = pose;
                let (parent, stamp_ns) = (header.frame_id.as_str(), header.stamp_ns);
                // A frame that has many parents loses one for the next.
                let parents = transforms.parents_of(&child_frame);
                let is_new = !transforms.has_link(parent, &child_frame);
                if is_new && (links >= MAX_LINKS || parent.len().max(child_frame.len()) > MAX_NAME_BYTES) {
                    beyond += 1;
                    return;
                }
                match transforms.insert(parent, &child_frame, stamp_ns, parent_from_child, is_static) {
                    Ok(false) => {}
                    Ok(true) => {
                        links += transforms.parents_of(&child_frame).saturating_sub(parents);
                        checked += 1;
                        if checked <= MAX_CHECKED && seconds.len() < MAX_SECONDS {
                            seconds.extend(transforms.second_parent(parent, &child_frame));
                        }
                    }
                    Err(why) => {
                        invalid += 1;
                        first_invalid.get_or_insert(why);
                    }
                }
            });
            if let Err(error) = decoded {
                note(format!("{}: {error}", topic.name));
            }
        }
        if let Some(spool) = spool {
            spool.finish(transforms.samples_mut().chain([&mut self.track.poses]))?;
        }
        if let Some(first) = first_bad {
            self.remarks
                .push(format!("{bad} messages or chunks with poses cannot be read; the first: {first}"));
        }
        if beyond > 0 {
            self.remarks.push(format!(
                "{beyond} transforms are left out: their frames are more than {MAX_LINKS}, or have names of more than \
                 {MAX_NAME_BYTES} bytes"
            ));
        }
        if let Some(first) = first_invalid {
            self.remarks.push(format!("{invalid} transforms are not valid and left out; the first: {first}"));
        }
        self.remarks.extend(seconds.into_iter().map(told));
        Ok(())
    }

    /// Where the sensor was; counts why not.
    pub(super) fn world_from_sensor(
        &mut self,
        sensor_frame: &str,
        stamp_ns: i64,
    ) -> Result<Option<RigidPose>> {
        let found = match self.source {
            PoseSource::None => return Ok(None),
            PoseSource::Odometry if !self.track.poses.is_empty() => {
                self.settle_track(sensor_frame);
                self.find(sensor_frame, stamp_ns)
            }
            _ => self.find(sensor_frame, stamp_ns),
        };
        match found {
            Ok(pose) => Ok(Some(pose)),
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

    /// Looks up where a sensor was at any time, once its first pose was asked for.
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

    /// The default frame of the map, above the frame of a sensor.
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
        // A mount alone says nothing of where the robot went.
        if !chain.iter().any(|frame| self.transforms.is_moving(frame)) {
            return Err(WhyNot::NothingMoves(sensor_frame.to_owned()));
        }
        Ok(self.transforms.root_of(sensor_frame))
    }

    /// Puts the poses of a topic among the transforms, in the place of those of the same frame.
    fn settle_track(&mut self, sensor_frame: &str) {
        let PoseTrack { parent, child: named, poses, mut odd } = std::mem::take(&mut self.track);
        let child = if named.is_empty() { self.base_of(sensor_frame) } else { named.clone() };
        let transforms = Arc::make_mut(&mut self.transforms);
        transforms.detach(&child);
        if self.fixed_frame.is_none() {
            // What is above the frame of the poses does not matter, and might lead back to its child.
            transforms.detach(&parent);
            self.fixed_frame = Some(parent.clone());
        }
        let count = poses.len() as u64;
        match transforms.attach(&parent, &child, poses) {
            Ok(_) => self.remarks.extend(transforms.second_parent(&parent, &child).map(told)),
            Err(_) => odd += count,
        }
        if odd > 0 {
            let remark = format!(
                "{odd} poses are not valid, or of other frames than {parent} and {child}, and left out"
            );
            self.remarks.push(remark);
        }
        if named.is_empty() {
            self.remarks.push(format!(
                "the poses do not say of which frame they are; they are taken as those of {child}"
            ));
        }
    }

    /// The frame that poses without a name are of: the base of the robot that carries the sensor, or the sensor.
    fn base_of(&self, sensor_frame: &str) -> String {
        let chain = self.transforms.ancestors(sensor_frame);
        let base = BASE_FRAMES.into_iter().find(|base| chain.iter().any(|frame| frame == base));
        base.unwrap_or(sensor_frame).to_owned()
    }

    /// What a person should know.
    pub(super) fn remarks(&self) -> impl Iterator<Item = String> + '_ {
        let without = self.without.iter().map(|(why, count)| format!("{count} clouds have no pose: {why}"));
        self.remarks.iter().cloned().chain(without)
    }
}

fn told(second: SecondParent) -> String {
    format!(
        "{second}; a parent named by one transform, or one that closes a loop, is used only if no other leads to the map \
         frame"
    )
}
