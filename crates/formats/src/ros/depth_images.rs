use super::depth_name::DepthName;
use super::messages::{CompressedDepth, Image, MessageKind, is_depth_encoding};
use super::recording::{Recording, Topic};
use voxtile::{Error, Result};

/// Properties of a topic's images, for deciding whether its pixels are depths.
#[derive(Clone, Debug)]
pub(super) struct DepthImages {
    /// Pixel encoding, such as `16UC1`.
    pub(super) encoding: String,
    /// Evidence from the names of the topic and the frame.
    name: Option<DepthName>,
    /// Whether the images have a compression that is used only for depths.
    is_depth_transport: bool,
    is_compressed: bool,
}

/// Name suffixes of topics with compressed images.
const TRANSPORTS: [&str; 2] = ["/compressedDepth", "/compressed"];

/// Returns the name of the topic with the uncompressed images.
pub(super) fn base_name(image: &str) -> &str {
    TRANSPORTS.iter().find_map(|transport| image.strip_suffix(transport)).unwrap_or(image)
}

/// Returns the name of the topic with the camera of the images.
pub(super) fn camera_name(image: &str) -> String {
    let (folder, _) = base_name(image).rsplit_once('/').unwrap_or_default();
    format!("{folder}/camera_info")
}

impl DepthImages {
    /// Inspects the first image of a topic. Returns `None` if there is none, or if its pixels cannot be depths.
    pub(super) fn of_topic(
        recording: &mut dyn Recording,
        index: usize,
        topic: &Topic,
        kind: MessageKind,
        whole_bytes: u64,
    ) -> Result<Option<Self>> {
        recording.begin(&[index])?;
        let first = match recording.next_message() {
            Err(error @ Error::Io { .. }) => return Err(error),
            // Damaged chunks are reported when the clouds are read.
            first => first.unwrap_or_default(),
        };
        let Some((mut message, wire)) = first.zip(topic.wire) else { return Ok(None) };
        if message.data.len() > whole_bytes {
            return Ok(None);
        }
        let data = message.data.load(whole_bytes)?;
        let found = match kind {
            MessageKind::CompressedImage => CompressedDepth::decode(wire, data)
                .map(|image| (image.header.frame_id, image.encoding, image.is_depth_transport)),
            _ => Image::decode(wire, data).map(|image| (image.header.frame_id, image.encoding, false)),
        };
        let is_compressed = kind == MessageKind::CompressedImage;
        Ok(found.ok().and_then(|(frame, encoding, is_depth_transport)| {
            let name = DepthName::of(base_name(&topic.name)).or_else(|| DepthName::of(&frame));
            let may_be = is_compressed || is_depth_encoding(&encoding);
            may_be.then_some(Self { encoding, name, is_depth_transport, is_compressed })
        }))
    }

    /// Returns whether pixels are depths. `None`: probably, because the encoding is common for depths, but without
    /// further evidence.
    pub(super) fn holds_depths(&self) -> Option<bool> {
        match self.name {
            Some(name) => Some(name == DepthName::Depth),
            None if self.is_depth_transport => Some(true),
            // Cameras use these encodings for brightness and temperature too.
            None if self.is_compressed || self.encoding == "mono16" => Some(false),
            None => None,
        }
    }
}
