use super::bag_topic::{Chosen, chosen, kind_of, list};
use super::depth_images::{DepthImages, base_name, camera_name};
use super::depth_name::DepthName;
use super::messages::{MessageKind, driver_of};
use super::recording::{Recording, Topic};
use std::collections::HashSet;
use voxtile::{Error, Result};

/// Topics of a recording that may contain clouds.
#[derive(Debug, Default)]
pub(super) struct CloudTopics {
    found: Vec<Found>,
    /// Topics used only if there is nothing else: copies of the same clouds, and less likely kinds.
    others: Vec<Found>,
    /// Image topics that may contain depths or not.
    unsure: Vec<String>,
    /// Image topics named as depth but without a camera.
    without_camera: Vec<String>,
}

#[derive(Debug)]
struct Found {
    index: usize,
    kind: MessageKind,
    /// Image encoding, if it is the only evidence for depths.
    guessed: Option<String>,
}

/// Limit for the image topics to inspect. With more, the user must select a topic.
const MAX_LOOKED_INTO: usize = 100;
/// Maximum number of topics named for a reason.
const MAX_NAMED: usize = 10;

impl CloudTopics {
    pub(super) fn find(recording: &mut dyn Recording, topics: &[Topic], whole_bytes: u64) -> Result<Self> {
        let (mut all, mut looked_into) = (Self::default(), 0);
        let is_camera = |topic: &&Topic| kind_of(topic) == Some(MessageKind::CameraInfo);
        let cameras: HashSet<&str> =
            topics.iter().filter(is_camera).map(|topic| topic.name.as_str()).collect();
        for (index, topic) in topics.iter().enumerate().filter(|(_, topic)| topic.messages > 0) {
            let Some(kind) = kind_of(topic).filter(|kind| kind.is_cloud()) else { continue };
            let mut found = Found { index, kind, guessed: None };
            if !kind.is_image() {
                all.push(found, kind == MessageKind::PointCloud);
                continue;
            }
            if !cameras.contains(camera_name(&topic.name).as_str()) {
                if DepthName::of(base_name(&topic.name)) == Some(DepthName::Depth) {
                    all.without_camera.push(topic.name.clone());
                }
                continue;
            }
            let is_compressed = kind == MessageKind::CompressedImage;
            // Inspecting a topic may read the recording up to its first image.
            looked_into += 1;
            if looked_into <= MAX_LOOKED_INTO {
                let images = DepthImages::of_topic(recording, index, topic, kind, whole_bytes)?;
                let Some(images) = images else { continue };
                match images.holds_depths() {
                    Some(false) => {
                        all.unsure.push(format!("{} ({})", topic.name, images.encoding));
                        continue;
                    }
                    Some(true) => {}
                    None => found.guessed = Some(images.encoding),
                }
            } else if is_compressed {
                continue;
            }
            all.push(found, is_compressed);
        }
        all.drop_copies(topics);
        Ok(all)
    }

    fn push(&mut self, found: Found, is_other: bool) {
        match is_other {
            true => self.others.push(found),
            false => self.found.push(found),
        }
    }

    /// Drops compressed images that another topic also contains.
    fn drop_copies(&mut self, topics: &[Topic]) {
        let name_of = |found: &Found| topics.get(found.index).map_or("", |topic| topic.name.as_str());
        let plain: HashSet<&str> = self.found.iter().map(name_of).collect();
        let depths: HashSet<&str> = self.others.iter().map(name_of).collect();
        self.others.retain(|found| {
            let (name, base) = (name_of(found), base_name(name_of(found)));
            let other = format!("{base}/compressedDepth");
            let is_copy =
                base != name && (plain.contains(base) || (name != other && depths.contains(other.as_str())));
            !is_copy
        });
    }

    /// Selects the topic of the clouds, which must be the only candidate.
    pub(super) fn choose(self, recording: &dyn Recording, topics: &[Topic]) -> Result<Chosen> {
        let (first, rest) = match self.found.is_empty() {
            true => (&self.others, &[][..]),
            false => (&self.found, self.others.as_slice()),
        };
        let of = |found: &Found| topics.get(found.index);
        match first.as_slice() {
            [] => Err(Error::argument("recording", self.why_none(recording, topics))),
            [only] => {
                let mut chosen = chosen(topics, only.index, only.kind)?;
                let name = of(only).map_or("", |topic| topic.name.as_str());
                if let Some(encoding) = &only.guessed {
                    chosen.remarks.push(format!(
                        "{name} is read as depth images because of its encoding {encoding}, although its name does not \
                         contain \"depth\""
                    ));
                }
                if !rest.is_empty() {
                    let rest = list(rest.iter().filter_map(of));
                    chosen.remarks.push(format!(
                        "{name} is read; other topics can be chosen with `topic` NAME: {rest}"
                    ));
                }
                chosen.remarks.extend(self.why_unsure().map(|why| format!("ignored: {why}")));
                Ok(chosen)
            }
            several => {
                let several = list(several.iter().filter_map(of));
                let reason =
                    format!("several topics contain clouds; choose one with `topic` NAME: {several}");
                Err(Error::argument("recording", reason))
            }
        }
    }

    fn why_unsure(&self) -> Option<String> {
        (!self.unsure.is_empty()).then(|| {
            format!(
                "images that are not named as depth: {}; if they are depth images, select the topic with `topic`",
                named(&self.unsure)
            )
        })
    }

    fn why_none(&self, recording: &dyn Recording, topics: &[Topic]) -> String {
        // Add the remarks of the recording, because a truncated file may lack the topics.
        let found_out =
            recording.remarks().into_iter().fold(String::new(), |all, remark| all + "; " + &remark);
        if topics.is_empty() {
            return format!("it contains no topics{found_out}");
        }
        let list = list(topics.iter());
        if topics.iter().all(|topic| topic.messages == 0) {
            return format!("it contains no messages{found_out}; topics: {list}");
        }
        let camera = (!self.without_camera.is_empty()).then(|| {
            let names: Vec<String> = self
                .without_camera
                .iter()
                .map(|name| format!("{name} without {}", camera_name(name)))
                .collect();
            format!("depth images need their camera, a topic of type CameraInfo: {}", named(&names))
        });
        let packets: Vec<String> =
            topics.iter().filter(|topic| topic.messages > 0).filter_map(packets_of).take(MAX_NAMED).collect();
        let is_unread = |topic: &&Topic| topic.messages > 0 && topic.wire.is_none();
        let unread: Vec<String> = topics.iter().filter(is_unread).map(|topic| topic.name.clone()).collect();
        let unread = (!unread.is_empty()).then(|| {
            format!(
                "messages with another serialization than that of ROS are not supported: {}",
                named(&unread)
            )
        });
        let whys = self.why_unsure().into_iter().chain(camera).chain(packets).chain(unread);
        let whys = whys.fold(String::new(), |all, why| all + "; " + &why);
        format!(
            "no topic contains clouds (PointCloud2, PointCloud, CustomMsg of Livox, LaserScan, depth \
             images){whys}{found_out}; topics: {list}"
        )
    }
}

/// Returns advice for a topic of packets.
pub(super) fn packets_of(topic: &Topic) -> Option<String> {
    let driver = driver_of(&topic.type_name)?;
    Some(format!("{} contains no points: convert it to clouds with {driver} and use that topic", topic.name))
}

fn named(names: &[String]) -> String {
    let more = if names.len() > MAX_NAMED { ", .." } else { "" };
    names.iter().take(MAX_NAMED).map(String::as_str).collect::<Vec<_>>().join(", ") + more
}
