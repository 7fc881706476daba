use super::bag_options::BagOptions;
use super::bag_poses::BagPoses;
use super::bag_topic::{Chosen, choose_clouds};
use super::cloud_message::CloudMessage;
use super::message_data::{MessageData, read};
use super::messages::{CameraInfo, Header, MAX_HEAD_BYTES, MessageKind};
use super::open::open_recording_within;
use super::recording::{Message, Recording, Topic};
use super::registered::find_registered;
use super::wire::Wire;
use crate::read::attribute_columns::AttributeValues;
use crate::read::cloud::{CloudHead, CloudPoint, CloudSource, PoseAt};
use crate::spill::{Bytes, FilePart};
use std::collections::BTreeMap;
use std::path::PathBuf;
use voxtile::scan::AttributeSet;
use voxtile::{Error, FormatError, Result};

/// Source of the clouds of one topic of a recording, with the poses from the recording.
pub struct BagClouds {
    path: PathBuf,
    recording: Box<dyn Recording>,
    topic: Topic,
    wire: Wire,
    chosen: Chosen,
    camera: Option<CameraInfo>,
    poses: BagPoses,
    /// Number of the next cloud.
    next: u64,
    current: Option<Current>,
    /// Maximum size of a message held in memory.
    whole_bytes: u64,
    /// Frame of the current cloud.
    frame: Option<String>,
    /// Number of clouds with stamp 0.
    without_stamp: u64,
    /// Number of clouds for each repair of inconsistent messages.
    repaired: BTreeMap<&'static str, u64>,
    /// Attributes to read.
    attributes: AttributeSet,
    /// Converts values to attributes.
    values: AttributeValues,
}

/// Message of the current cloud.
struct Current {
    log_ns: i64,
    /// The message, or only its first bytes if it is large.
    bytes: Vec<u8>,
    /// The complete message, if it is large.
    part: Option<FilePart>,
}

/// Opens the clouds of a recording: a file, a ROS 2 bag folder, or several recordings that follow each other in time.
///
/// This function reads the recording once for its poses. The clouds are read later.
///
/// # Errors
///
/// A file cannot be read or is not a recording; there is no topic with clouds, or there are several and none is
/// selected.
pub fn open_bag(paths: &[PathBuf], options: &BagOptions) -> Result<BagClouds> {
    let path = paths.first().cloned().unwrap_or_default();
    let name_it = |error| match error {
        Error::InvalidArgument { argument, reason } if argument == "recording" => {
            Error::argument(path.display().to_string(), reason)
        }
        error => error,
    };
    let mut recording = open_recording_within(paths, &options.budget()).map_err(name_it)?;
    let whole_bytes = options.budget().whole_bytes();
    let chosen = choose_clouds(recording.as_mut(), options.topic.as_deref(), whole_bytes).map_err(name_it)?;
    let poses = BagPoses::read(recording.as_mut(), options)
        .and_then(|poses| find_registered(recording.as_mut(), chosen.index, poses, options))
        .map_err(name_it)?;
    let topic = recording.topics().get(chosen.index).cloned();
    let gone = || Error::argument(path.display().to_string(), "the topic of the clouds is missing now");
    let topic = topic.ok_or_else(gone)?;
    let wire = topic.wire.ok_or_else(gone)?;
    let camera = match chosen.camera {
        Some(index) => Some(read_camera(recording.as_mut(), index, whole_bytes).map_err(name_it)?),
        None => None,
    };
    recording.begin(&[chosen.index])?;
    Ok(BagClouds {
        path,
        recording,
        topic,
        wire,
        chosen,
        camera,
        poses,
        next: 0,
        current: None,
        whole_bytes,
        frame: None,
        without_stamp: 0,
        repaired: BTreeMap::new(),
        attributes: options.attributes,
        values: AttributeValues::default(),
    })
}

/// Reads the first valid camera message of a topic. Cameras do not change during a recording.
fn read_camera(recording: &mut dyn Recording, index: usize, whole_bytes: u64) -> Result<CameraInfo> {
    let topic = recording.topics().get(index).cloned();
    let (name, wire) = topic.map_or_else(Default::default, |topic| (topic.name, topic.wire));
    recording.begin(&[index])?;
    let mut last = format!("depth images need their camera, but {name} has no message");
    loop {
        match recording.next_message() {
            Ok(Some(mut message)) => {
                let data = message.data.load(whole_bytes);
                let data = data.map_err(|error| format!("{error:#}"));
                let decode = |data: &[u8]| CameraInfo::decode(wire.unwrap_or(Wire::Cdr), data);
                match data.and_then(|data| decode(data).map_err(|error| error.to_string())) {
                    Ok(camera) => return Ok(camera),
                    Err(error) => last = format!("no message of {name} is valid; the last: {error}"),
                }
            }
            Ok(None) => return Err(Error::argument("recording", last)),
            Err(error @ Error::Io { .. }) => return Err(error),
            // Damaged parts are reported when the clouds are read.
            Err(_) => {}
        }
    }
}

impl BagClouds {
    /// Returns the topic of the clouds.
    pub fn topic(&self) -> &Topic {
        &self.topic
    }

    /// Returns all topics of the recording.
    pub fn topics(&self) -> &[Topic] {
        self.recording.topics()
    }

    /// Returns the part of a message that is held in memory.
    fn current(&self, message: Message, number: u64) -> Result<Current> {
        let Message { log_ns, mut data, .. } = message;
        if self.chosen.kind != MessageKind::PointCloud2 {
            // Only PointCloud2 can be read in parts.
            data.load(self.whole_bytes).map_err(|error| match error {
                Error::InvalidArgument { reason, .. } => self.wrong(number, &reason),
                error => error,
            })?;
        }
        Ok(match data {
            MessageData(Bytes::Memory(bytes)) => Current { log_ns, bytes, part: None },
            MessageData(Bytes::File(part)) => {
                Current { log_ns, bytes: read(&part, MAX_HEAD_BYTES)?, part: Some(part) }
            }
        })
    }

    fn decode<'a>(&'a self, message: &'a Current, number: u64) -> Result<CloudMessage<'a>> {
        let (kind, wire, bytes) = (self.chosen.kind, self.wire, message.bytes.as_slice());
        let cloud = match &message.part {
            Some(part) => CloudMessage::decode_start(wire, bytes, part.len()),
            None => CloudMessage::decode(kind, wire, bytes, self.camera.as_ref()),
        };
        cloud.map_err(|error| self.wrong(number, &error))
    }

    fn wrong(&self, number: u64, error: &dyn std::fmt::Display) -> Error {
        FormatError::at_record(number, format!("topic {}: {error}", self.topic.name)).in_input(&self.path)
    }
}

/// Returns the time stamp of a cloud, or its recording time if the stamp is 0, as from drivers without a clock.
fn stamp_of(header: &Header, message: &Current) -> i64 {
    if header.stamp_ns == 0 { message.log_ns } else { header.stamp_ns }
}

impl CloudSource for BagClouds {
    fn format(&self) -> &str {
        self.recording.format()
    }

    fn len_hint(&self) -> Option<u64> {
        Some(self.topic.messages)
    }

    fn next_cloud(&mut self) -> Result<Option<CloudHead>> {
        self.current = None;
        let message = match self.recording.next_message() {
            Ok(Some(message)) => message,
            Ok(None) => return Ok(None),
            Err(error) => {
                // A damaged cloud also uses up a number, so that later clouds keep theirs.
                self.next += u64::from(!matches!(error, Error::Io { .. }));
                return Err(error);
            }
        };
        let number = self.next;
        self.next += 1;
        let message = self.current(message, number)?;
        let mut cloud = self.decode(&message, number)?;
        cloud.read_attributes(self.attributes, AttributeValues::default());
        let header = cloud.header().clone();
        let stamp_ns = stamp_of(&header, &message);
        let (points, fields) = (cloud.points_claimed(), cloud.fields());
        let (has_intensities, has_times) = (cloud.has_intensities(), cloud.has_times());
        let attributes = cloud.attributes();
        for repair in cloud.repairs().to_vec() {
            *self.repaired.entry(repair).or_default() += 1;
        }
        self.without_stamp += u64::from(header.stamp_ns == 0);
        let placed = self.poses.place(&header.frame_id, stamp_ns)?;
        let head = CloudHead {
            name: number.to_string(),
            stamp_ns: Some(stamp_ns),
            world_from_sensor: placed.map(|placed| placed.world_from_sensor),
            is_in_world: placed.is_some_and(|placed| placed.is_in_world),
            frame: Some(header.frame_id),
            points: Some(points),
            fields,
            has_intensities,
            has_times,
            attributes,
        };
        self.current = Some(message);
        self.frame.clone_from(&head.frame);
        Ok(Some(head))
    }

    fn read_points(&mut self, visit: &mut dyn FnMut(CloudPoint) -> Result<()>) -> Result<()> {
        let Some(message) = self.current.take() else { return Ok(()) };
        let number = self.next.saturating_sub(1);
        let mut cloud = self.decode(&message, number)?;
        let stamp_ns = stamp_of(cloud.header(), &message);
        cloud.count_times_from(stamp_ns);
        cloud.read_attributes(self.attributes, self.values.clone());
        let shortage = cloud.visit(message.part.as_ref(), visit)?;
        let values = cloud.into_values();
        self.values = values.unwrap_or_default();
        shortage.map_or(Ok(()), |error| Err(self.wrong(number, &error)))
    }

    fn poses(&self) -> Option<PoseAt> {
        let lookup = self.poses.lookup(self.frame.as_deref()?).ok()?;
        Some(Box::new(move |stamp_ns| lookup.pose(stamp_ns)))
    }

    fn remarks(&self) -> Vec<String> {
        let mut remarks = self.recording.remarks();
        remarks.extend(self.chosen.remarks.iter().cloned());
        remarks.extend(self.poses.remarks());
        remarks.extend(self.values.remarks());
        remarks.extend(self.repaired.iter().map(|(repair, count)| format!("{count} clouds {repair}")));
        if self.without_stamp > 0 {
            let count = self.without_stamp;
            remarks.push(format!("{count} clouds have no stamp; their recording times are used"));
        }
        remarks
    }
}
