use std::fmt;
use std::path::PathBuf;

/// Origin of the poses of scans.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PoseSource {
    /// The input stores a pose with each scan.
    Scans,
    /// A pose file with one pose per scan.
    File(PathBuf),
    /// The `VIEWPOINT` of each PCD file.
    Viewpoint,
    /// No poses: every scan is in the world frame.
    Identity,
    /// No poses are known.
    Missing,
}

impl fmt::Display for PoseSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scans => f.write_str("in the input, one per scan"),
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Viewpoint => f.write_str("VIEWPOINT of each file"),
            Self::Missing => f.write_str("none"),
            Self::Identity => f.write_str("identity: the scans are in the world frame"),
        }
    }
}
