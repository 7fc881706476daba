use super::depth_name::DepthName;
use super::messages::{CompressedDepth, Image, MessageKind, is_depth_encoding};
use super::recording::{Recording, Topic};
use voxtile::{Error, Result};

/// What is known of the images of a topic, whose pixels may be depths.
#[derive(Clone, Debug)]
pub(super) struct DepthImages {
    /// What a pixel is: `16UC1`.
    pub(super) encoding: String,
    /// What the names of topic and frame say.
    name: Option<DepthName>,
    /// Whether they are compressed in a way that is for depths alone.
    is_depth_transport: bool,
    is_compressed: bool,
}

/// Ends of the names of topics with images that are compressed.
const TRANSPORTS: [&str; 2] = ["/compressedDepth", "/compressed"];

/// The topic that the images of a topic are published on when they are not compressed.
pub(super) fn base_name(image: &str) -> &str {
    TRANSPORTS.iter().find_map(|transport| image.strip_suffix(transport)).unwrap_or(image)
}

/// The camera of images is described beside them.
pub(super) fn camera_name(image: &str) -> String {
    let (folder, _) = base_name(image).rsplit_once('/').unwrap_or_default();
    format!("{folder}/camera_info")
}

impl DepthImages {
    /// Looks at the first image of a topic. `None` if there is none, or if its pixels cannot be depths.
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
            // Bad chunks are told of when clouds are read.
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

    /// Whether pixels are depths. `None`: probably, as cameras write depths so, but nothing else says it.
    pub(super) fn holds_depths(&self) -> Option<bool> {
        match self.name {
            Some(name) => Some(name == DepthName::Depth),
            None if self.is_depth_transport => Some(true),
            // As cameras write brightness and temperatures, too.
            None if self.is_compressed || self.encoding == "mono16" => Some(false),
            None => None,
        }
    }
}
