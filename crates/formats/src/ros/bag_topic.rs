use super::cloud_topics::{CloudTopics, packets_of};
use super::depth_images::{DepthImages, camera_name};
use super::messages::MessageKind;
use super::recording::{Recording, Topic};
use voxtile::{Error, Result};

/// Maximum number of topics listed in an error.
const MAX_LISTED: usize = 100;

/// A selected topic.
#[derive(Clone, Debug)]
pub(super) struct Chosen {
    pub(super) index: usize,
    pub(super) kind: MessageKind,
    /// Camera topic, for depth images.
    pub(super) camera: Option<usize>,
    /// Remarks for the user about the selection.
    pub(super) remarks: Vec<String>,
}

/// Returns the message type of a topic if it can be decoded.
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
        let Some((topic, kind)) =
            topic.and_then(|topic| Some((topic, kind_of(topic).filter(|kind| kind.is_cloud())?)))
        else {
            let type_name = topic.map_or("", |topic| topic.type_name.as_str());
            let packets = topic.and_then(packets_of).map(|packets| packets + "; ").unwrap_or_default();
            let list = list(topics.iter());
            let reason = format!("messages of type {type_name} are not clouds; {packets}topics: {list}");
            return Err(Error::argument(format!("topic {name}"), reason));
        };
        let mut chosen = chosen(&topics, index, kind)?;
        if kind.is_image()
            && let Some(images) = DepthImages::of_topic(recording, index, topic, kind, whole_bytes)?
            && images.holds_depths() == Some(false)
        {
            let encoding = &images.encoding;
            chosen.remarks.push(format!(
                "{} ({encoding}) is read as depth images, because it was selected",
                topic.name
            ));
        }
        return Ok(chosen);
    }
    CloudTopics::find(recording, &topics, whole_bytes)?.choose(recording, &topics)
}

/// Finds the topic of the poses.
pub(super) fn choose_poses(topics: &[Topic], name: Option<&str>) -> Result<usize> {
    if let Some(name) = name {
        let index = named(topics, name, "odometry")?;
        let topic = topics.get(index).filter(|topic| kind_of(topic).is_some_and(MessageKind::is_pose));
        return topic.map(|_| index).ok_or_else(|| {
            let reason = format!("its messages are not poses; topics: {}", list(topics.iter()));
            Error::argument(format!("odometry {name}"), reason)
        });
    }
    let is_pose = |topic: &&Topic| topic.messages > 0 && kind_of(topic).is_some_and(MessageKind::is_pose);
    let found: Vec<&Topic> = topics.iter().filter(is_pose).collect();
    // Odometry messages name the moving frame; poses and paths do not.
    let odometry: Vec<_> =
        found.iter().filter(|topic| kind_of(topic) == Some(MessageKind::Odometry)).collect();
    match (odometry.as_slice(), found.as_slice()) {
        ([topic], _) => index_of(topics, topic),
        ([], [topic]) => index_of(topics, topic),
        ([], []) => {
            let reason = format!(
                "no topic contains poses (Odometry, PoseStamped, Path); topics: {}",
                list(topics.iter())
            );
            Err(Error::argument("recording", reason))
        }
        _ => {
            let found = list(found.into_iter());
            let reason = format!("several topics contain poses; choose one with `odometry` NAME: {found}");
            Err(Error::argument("recording", reason))
        }
    }
}

fn index_of(topics: &[Topic], wanted: &Topic) -> Result<usize> {
    let index = topics.iter().position(|topic| topic == wanted);
    index.ok_or_else(|| Error::argument("recording", "the topic is missing now"))
}

fn named(topics: &[Topic], name: &str, option: &str) -> Result<usize> {
    // If the parts of a split recording have different types for a topic, the part with most messages is used.
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

/// Returns the selection of a topic, with its camera if it contains images.
pub(super) fn chosen(topics: &[Topic], index: usize, kind: MessageKind) -> Result<Chosen> {
    let (camera, remarks) = (None, Vec::new());
    let Some(image) = topics.get(index).filter(|_| kind.is_image()) else {
        return Ok(Chosen { index, kind, camera, remarks });
    };
    let name = camera_name(&image.name);
    let is_camera = |topic: &Topic| topic.name == name && kind_of(topic) == Some(MessageKind::CameraInfo);
    match topics.iter().position(is_camera) {
        Some(camera) => Ok(Chosen { index, kind, camera: Some(camera), remarks }),
        None => {
            let reason =
                format!("depth images need their camera, but there is no topic {name} of type CameraInfo");
            Err(Error::argument(format!("topic {}", image.name), reason))
        }
    }
}

/// Formats topics as `/points (sensor_msgs/msg/PointCloud2, 20 messages), ...`.
pub(super) fn list<'t>(topics: impl Iterator<Item = &'t Topic>) -> String {
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
