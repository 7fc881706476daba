/// Meaning of image pixels according to the name of a topic or frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DepthName {
    Depth,
    /// Temperature, brightness, confidence or similar.
    Other,
}

/// Prefixes and whole words in names of images that are not depths.
const OTHER_BEGINNINGS: [&str; 15] = [
    "amplitude",
    "boson",
    "confidence",
    "disparity",
    "flir",
    "infra",
    "intensity",
    "lepton",
    "nearir",
    "optris",
    "reflec",
    "seek",
    "signal",
    "temperature",
    "therm",
];
const OTHER_WORDS: [&str; 11] =
    ["ambient", "disp", "grey", "gray", "ir", "lwir", "mono", "mwir", "nir", "noise", "swir"];

impl DepthName {
    /// Classifies by the last meaningful word of the last meaningful path component: `/depth_camera/ir/image_raw` is
    /// infrared, `aligned_depth_to_infra1` is depth.
    pub(super) fn of(name: &str) -> Option<Self> {
        name.rsplit('/').find_map(|part| {
            let lower = part.to_lowercase();
            let what = lower.split("_to_").next().unwrap_or_default();
            what.split(|c: char| !c.is_alphanumeric()).filter_map(Self::of_word).next_back()
        })
    }

    fn of_word(word: &str) -> Option<Self> {
        if word.contains("depth") {
            return Some(Self::Depth);
        }
        let bare = word.trim_end_matches(|c: char| c.is_ascii_digit());
        let is_other =
            OTHER_BEGINNINGS.iter().any(|start| word.starts_with(start)) || OTHER_WORDS.contains(&bare);
        is_other.then_some(Self::Other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn last_word_determines_the_pixels() {
        for name in [
            "/camera/depth/image_raw",
            "/camera/aligned_depth_to_infra1/image_raw",
            "/kinect2/qhd/image_depth_rect",
            "/ir/depth",
            "camera_depth_optical_frame",
            "/cam/DepthImage",
            "/thermal_robot/depth/image",
        ] {
            assert_eq!(DepthName::of(name), Some(DepthName::Depth), "{name}");
        }
        for name in [
            "/thermal/image_raw",
            "/depth_camera/ir/image_raw",
            "/kinect2/sd/image_ir",
            "/camera/infra1/image_rect_raw",
            "/tof/depth_confidence",
            "/flir_boson/image16",
            "/ouster/nearir_image",
            "/ir1/image",
        ] {
            assert_eq!(DepthName::of(name), Some(DepthName::Other), "{name}");
        }
        for name in ["/camera/image_raw", "/mirror/image", "/first", ""] {
            assert_eq!(DepthName::of(name), None, "{name}");
        }
    }
}
