use super::bag_options::{BagOptions, PoseSource};
use super::bag_poses::BagPoses;
use super::bag_topic::kind_of;
use super::message_data::read;
use super::messages::{Header, MAX_HEAD_BYTES, MessageKind, StampedPose, visit_poses};
use super::recording::{Recording, Topic};
use super::wire::WireReader;
use crate::spill::Bytes;
use voxtile::{Error, Result};

/// An odometry topic and the frames of its first pose.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Odometry {
    pub(super) topic: String,
    pub(super) parent: String,
    pub(super) child: String,
}

/// Maximum number of odometry topics to inspect.
const MAX_LOOKED_INTO: usize = 20;
/// Maximum number of messages to read for the first pose of each topic.
const MAX_MESSAGES: usize = 10_000;

/// Finds the poses of clouds that are already in the map frame, as published by odometry programs. For such clouds
/// `/tf` does not contain the sensor position. The position is taken from a single odometry topic whose parent frame is
/// that of the clouds, or from a frame that moves relative to that of the clouds.
pub(super) fn find_registered(
    recording: &mut dyn Recording,
    clouds: usize,
    poses: BagPoses,
    options: &BagOptions,
) -> Result<BagPoses> {
    if options.poses != PoseSource::Tf || !options.are_poses_needed {
        return Ok(poses);
    }
    let Some(frame) = first_frame(recording, clouds)? else { return Ok(poses) };
    // Another map frame was requested.
    if options.fixed_frame.as_ref().is_some_and(|fixed| fixed.trim_start_matches('/') != frame) {
        return Ok(poses);
    }
    let all = odometries(recording, options)?;
    let of_clouds = |odometry: &&Odometry| {
        odometry.parent == frame && !["", frame.as_str()].contains(&odometry.child.as_str())
    };
    let from_here: Vec<&Odometry> = all.iter().filter(of_clouds).collect();
    let mut poses = poses;
    // A frame that moves in a map may be a sensor's, or may move because the map is corrected.
    let is_sensor = poses.moves(&frame) && (from_here.is_empty() || !poses.moves_below(&frame));
    if poses.places(&frame) && is_sensor {
        return Ok(poses);
    }
    if let [one] = from_here.as_slice() {
        let odometry_topic = Some(one.topic.clone());
        let options = BagOptions { poses: PoseSource::Odometry, odometry_topic, ..options.clone() };
        return match BagPoses::read(recording, &options) {
            Err(error) if !matches!(error, Error::Io { .. }) => Ok(poses),
            read => read,
        };
    }
    if !poses.see_from_below(&frame) && !from_here.is_empty() {
        let names: Vec<&str> = from_here.iter().map(|odometry| odometry.topic.as_str()).collect();
        let (first, names) = (names.first().copied().unwrap_or_default(), names.join(", "));
        poses.hint(format!(
            "the clouds are already in the frame {frame}, and several topics contain sensor poses in it ({names}): \
             select one, for instance `odometry` {first} `world_frame`"
        ));
    }
    Ok(poses)
}

/// Returns the frame of the first cloud, if it can be read.
fn first_frame(recording: &mut dyn Recording, clouds: usize) -> Result<Option<String>> {
    let wire = recording.topics().get(clouds).and_then(|topic| topic.wire);
    recording.begin(&[clouds])?;
    let first = match recording.next_message() {
        Err(error @ Error::Io { .. }) => return Err(error),
        first => first.unwrap_or_default(),
    };
    let Some((message, wire)) = first.zip(wire) else { return Ok(None) };
    let (len, start) = (
        message.data.len(),
        match &message.data.0 {
            Bytes::Memory(bytes) => bytes,
            Bytes::File(part) => &read(part, MAX_HEAD_BYTES)?,
        },
    );
    let header = WireReader::of_start(wire, start, len).and_then(|mut reader| Header::read(&mut reader));
    Ok(header.ok().map(|header| header.frame_id))
}

/// Finds the odometry topics.
fn odometries(recording: &mut dyn Recording, options: &BagOptions) -> Result<Vec<Odometry>> {
    let topics = recording.topics().to_vec();
    let is_odometry =
        |(_, topic): &(usize, &Topic)| topic.messages > 0 && kind_of(topic) == Some(MessageKind::Odometry);
    let all = topics.iter().enumerate().filter(is_odometry);
    let mut left: Vec<usize> = all.map(|(index, _)| index).take(MAX_LOOKED_INTO).collect();
    let mut found = Vec::new();
    if left.is_empty() {
        return Ok(found);
    }
    let whole_bytes = options.budget().whole_bytes();
    recording.begin(&left)?;
    for _ in 0..MAX_MESSAGES {
        if left.is_empty() {
            break;
        }
        let mut message = match recording.next_message() {
            Ok(Some(message)) => message,
            Ok(None) => break,
            Err(error @ Error::Io { .. }) => return Err(error),
            Err(_) => continue,
        };
        let topic = topics.get(message.topic).filter(|_| left.contains(&message.topic));
        let Some((topic, wire)) = topic.and_then(|topic| Some((topic, topic.wire?))) else { continue };
        let Ok(data) = message.data.load(whole_bytes) else { continue };
        let mut take = |pose: StampedPose| {
            let StampedPose { header, child_frame: child, .. } = pose;
            found.push(Odometry { topic: topic.name.clone(), parent: header.frame_id, child });
        };
        if visit_poses(MessageKind::Odometry, wire, data, &mut take).is_ok() {
            left.retain(|index| *index != message.topic);
        }
    }
    Ok(found)
}
