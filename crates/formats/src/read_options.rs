use super::posed_clouds::CloudOptions;
use super::selected_scans::Selection;
use crate::clouds::read::OpenOptions;
use std::path::PathBuf;
#[cfg(feature = "ros")]
use voxtile::{Error, Result};

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

impl ReadOptions {
    /// The same, with the files that are named for something else known to be no clouds.
    pub(super) fn with_not_clouds(&self) -> Self {
        let mut options = self.clone();
        let named = [&self.poses, &self.calib, &self.open.intrinsics_path];
        options.open.not_clouds.extend(named.into_iter().flatten().cloned());
        options
    }

    /// Refuses what a recording says itself, and what would be passed over.
    #[cfg(feature = "ros")]
    pub(super) fn check_for_recording(&self) -> Result<()> {
        if self.open.depth_scale.is_some() {
            let reason = "depth images of a recording say themselves what they are in, 16UC1 millimetres and 32FC1 metres: \
                          leave it out";
            return Err(Error::argument("depth_scale", reason));
        }
        if self.open.intrinsics_path.is_some() || self.open.intrinsics.is_some() {
            let reason = "the camera of a recording is in the topic `camera_info` beside its depth images: leave it out";
            return Err(Error::argument("intrinsics", reason));
        }
        Ok(())
    }
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
