use super::messages::{Image, MessageKind, is_depth_encoding};
use super::recording::{Recording, Topic};
use std::collections::HashSet;
use voxtile::{Error, Result};

/// Most topics of images that are looked into. Of more, the user chooses.
const MAX_LOOKED_INTO: usize = 100;
/// Most topics that an error lists.
const MAX_LISTED: usize = 100;

/// A topic that was chosen.
#[derive(Clone, Debug)]
pub(super) struct Chosen {
    pub(super) index: usize,
    pub(super) kind: MessageKind,
    /// The topic of the camera, for depth images.
    pub(super) camera: Option<usize>,
}

/// The kind of the messages of a topic that can be decoded.
pub(super) fn kind_of(topic: &Topic) -> Option<MessageKind> {
    topic.wire.and(MessageKind::of(&topic.type_name))
}

/// Finds the topic of the clouds.
pub(super) fn choose_clouds(
    recording: &mut dyn Recording,
    name: Option<&str>,
    whole_bytes: u64,
) -> Result<Chosen> {
    let topics = recording.topics().to_vec();
    if let Some(name) = name {
        let index = named(&topics, name, "topic")?;
        let topic = topics.get(index);
        let Some(kind) = topic.and_then(kind_of).filter(|kind| kind.is_cloud()) else {
            let type_name = topic.map_or("", |topic| topic.type_name.as_str());
            return Err(Error::argument(
                format!("topic {name}"),
                format!("messages of type {type_name} are no clouds; topics: {}", list(topics.iter())),
            ));
        };
        return chosen(&topics, index, kind);
    }
    let (mut found, mut looked_into) = (Vec::new(), 0);
    let is_camera = |topic: &&Topic| kind_of(topic) == Some(MessageKind::CameraInfo);
    let cameras: HashSet<&str> = topics.iter().filter(is_camera).map(|topic| topic.name.as_str()).collect();
    for (index, topic) in topics.iter().enumerate().filter(|(_, topic)| topic.messages > 0) {
        let Some(kind) = kind_of(topic).filter(|kind| kind.is_cloud()) else { continue };
        let is_found = if kind != MessageKind::Image {
            true
        } else if !cameras.contains(camera_name(&topic.name).as_str()) {
            false
        } else {
            // Each look may read the recording up to the first image.
            looked_into += 1;
            looked_into > MAX_LOOKED_INTO || holds_depths(recording, index, topic, whole_bytes)?
        };
        if is_found {
            found.push((index, kind));
        }
    }
    match found.as_slice() {
        &[(index, kind)] => chosen(&topics, index, kind),
        [] => {
            let reason = match topics.as_slice() {
                [] => "it holds no topics".to_owned(),
                topics => format!(
                    "no topic holds clouds (PointCloud2, CustomMsg of Livox, LaserScan, depth images); topics: {}",
                    list(topics.iter())
                ),
            };
            Err(Error::argument("recording", reason))
        }
        several => {
            let several = several.iter().filter_map(|&(index, _)| topics.get(index));
            let reason =
                format!("several topics hold clouds; choose one with `topic` NAME: {}", list(several));
            Err(Error::argument("recording", reason))
        }
    }
}

/// Finds the topic of poses.
pub(super) fn choose_poses(topics: &[Topic], name: Option<&str>) -> Result<usize> {
    if let Some(name) = name {
        let index = named(topics, name, "odometry")?;
        let topic = topics.get(index).filter(|topic| kind_of(topic).is_some_and(MessageKind::is_pose));
        return topic.map(|_| index).ok_or_else(|| {
            let reason = format!("its messages are no poses; topics: {}", list(topics.iter()));
            Error::argument(format!("odometry {name}"), reason)
        });
    }
    let is_pose = |topic: &&Topic| topic.messages > 0 && kind_of(topic).is_some_and(MessageKind::is_pose);
    let found: Vec<&Topic> = topics.iter().filter(is_pose).collect();
    // Odometry says which frame moves, poses and paths do not.
    let odometry: Vec<_> =
        found.iter().filter(|topic| kind_of(topic) == Some(MessageKind::Odometry)).collect();
    match (odometry.as_slice(), found.as_slice()) {
        ([topic], _) => index_of(topics, topic),
        ([], [topic]) => index_of(topics, topic),
        ([], []) => {
            let reason = format!(
                "no topic holds poses (Odometry, PoseStamped, Path); topics: {}",
                list(topics.iter())
            );
            Err(Error::argument("recording", reason))
        }
        _ => {
            let found = list(found.into_iter());
            let reason = format!("several topics hold poses; choose one with `odometry` NAME: {found}");
            Err(Error::argument("recording", reason))
        }
    }
}

fn index_of(topics: &[Topic], wanted: &Topic) -> Result<usize> {
    let index = topics.iter().position(|topic| topic == wanted);
    index.ok_or_else(|| Error::argument("recording", "the topic is gone"))
}

fn named(topics: &[Topic], name: &str, option: &str) -> Result<usize> {
    // The part of a split recording with the most messages of a name speaks for it, if types differ.
    let same =
        topics.iter().enumerate().filter(|(_, topic)| topic.name.trim_matches('/') == name.trim_matches('/'));
    let best = same.max_by_key(|(_, topic)| (kind_of(topic).is_some(), topic.messages));
    best.map(|(index, _)| index).ok_or_else(|| {
        Error::argument(
            format!("{option} {name}"),
            format!("there is no such topic; topics: {}", list(topics.iter())),
        )
    })
}

fn chosen(topics: &[Topic], index: usize, kind: MessageKind) -> Result<Chosen> {
    let topic = topics.get(index).filter(|_| kind == MessageKind::Image);
    let camera = topic.and_then(|topic| camera_of(topics, topic));
    match topic.filter(|_| camera.is_none()) {
        None => Ok(Chosen { index, kind, camera }),
        Some(image) => {
            let name = camera_name(&image.name);
            let reason =
                format!("depth images need their camera, but there is no topic {name} of type CameraInfo");
            Err(Error::argument(format!("topic {}", image.name), reason))
        }
    }
}

/// The camera of images is described beside them.
fn camera_name(image: &str) -> String {
    let (folder, _) = image.rsplit_once('/').unwrap_or_default();
    format!("{folder}/camera_info")
}

fn camera_of(topics: &[Topic], image: &Topic) -> Option<usize> {
    let name = camera_name(&image.name);
    topics.iter().position(|topic| topic.name == name && kind_of(topic) == Some(MessageKind::CameraInfo))
}

/// Whether the first image of a topic holds depths.
fn holds_depths(
    recording: &mut dyn Recording,
    index: usize,
    topic: &Topic,
    whole_bytes: u64,
) -> Result<bool> {
    recording.begin(&[index])?;
    let first = match recording.next_message() {
        Err(error @ Error::Io { .. }) => return Err(error),
        // Bad chunks are told of when clouds are read.
        first => first.unwrap_or_default(),
    };
    let Some((mut message, wire)) = first.zip(topic.wire) else { return Ok(false) };
    if message.data.len() > whole_bytes {
        return Ok(false);
    }
    let data = message.data.load(whole_bytes)?;
    Ok(Image::decode(wire, data).is_ok_and(|image| is_depth_encoding(&image.encoding)))
}

/// `/points (sensor_msgs/msg/PointCloud2, 20 messages), ...`.
fn list<'t>(topics: impl Iterator<Item = &'t Topic>) -> String {
    let mut topics = topics.fuse();
    let mut text: Vec<String> = topics
        .by_ref()
        .take(MAX_LISTED)
        .map(|topic| format!("{} ({}, {} messages)", topic.name, topic.type_name, topic.messages))
        .collect();
    let more = topics.count();
    if more > 0 {
        text.push(format!("and {more} more"));
    }
    text.join(", ")
}
