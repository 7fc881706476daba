use super::posed_clouds::CloudOptions;
use super::selected_scans::Selection;
use std::path::PathBuf;
use voxtile_clouds::read::OpenOptions;

/// How an input of any known format is read; see [`open_any_scans`](super::open_any_scans).
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct ReadOptions {
    /// What the files do not say themselves.
    pub open: OpenOptions,
    /// What to take of a recording.
    pub recording: RecordingOptions,
    /// A file of poses, or `identity`: all scans are in the world frame.
    pub poses: Option<PathBuf>,
    /// The `calib.txt` of KITTI: poses are of the camera.
    pub calib: Option<PathBuf>,
    /// How clouds get their poses.
    pub clouds: CloudOptions,
    /// Which scans and points are taken.
    pub selection: Selection,
}

/// What to take of a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordingOptions {
    /// The topic with the clouds, where there are several.
    pub topic: Option<String>,
    /// A topic with poses, in place of `/tf`.
    pub odometry_topic: Option<String>,
    /// The frame that is the world.
    pub fixed_frame: Option<String>,
}
