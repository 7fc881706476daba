use super::format::Format;
use super::intrinsics::Intrinsics;
use crate::clouds::spill::Budget;
use std::path::PathBuf;

/// How clouds are read where their files do not say it.
#[derive(Clone, Debug)]
pub struct OpenOptions {
    /// The format; guessed if `None`.
    pub format: Option<Format>,
    /// Columns of a `.bin` file, each a float of four bytes: `x`, `y`, `z`, `intensity`, and any others. `None`:
    /// KITTI's four, or nuScenes' five for a `.pcd.bin`.
    pub fields: Option<Vec<String>>,
    /// A LAS file with GPS times is cut into scans of this many seconds. 0: the file is one cloud.
    pub scan_period_s: f64,
    /// Where the sensor was, in metres in the frame of the points: for clouds that are registered already and come
    /// without poses. Their points are then given relative to it, and the cloud says where it was.
    pub sensor_origin_m: Option<[f64; 3]>,
    /// Units of a depth image in a metre. `None`: 5000 for TUM RGB-D, 1000 (millimetres) otherwise.
    pub depth_scale: Option<f64>,
    /// The camera of depth images.
    pub intrinsics: Option<Intrinsics>,
    /// A file with the camera of depth images. `None`: `camera-intrinsics.txt` in the folder or beside it.
    pub intrinsics_path: Option<PathBuf>,
    /// Files that are no clouds, though they may lie among them: poses, calibrations. The camera above is one anyway.
    pub not_clouds: Vec<PathBuf>,
    /// Bytes of memory for what grows with the input; beyond them it goes to temporary files.
    pub memory_bytes: usize,
    /// Folder of temporary files; the system's own if `None`.
    pub scratch: Option<PathBuf>,
}

impl OpenOptions {
    /// How much memory reading may take, and where the rest goes.
    pub fn budget(&self) -> Budget {
        Budget { bytes: self.memory_bytes, scratch: self.scratch.clone() }
    }

    /// The files that are no clouds.
    pub(super) fn beside(&self) -> Vec<PathBuf> {
        self.not_clouds.iter().chain(&self.intrinsics_path).cloned().collect()
    }
}

impl Default for OpenOptions {
    fn default() -> Self {
        Self {
            format: None,
            fields: None,
            scan_period_s: 0.1,
            sensor_origin_m: None,
            depth_scale: None,
            intrinsics: None,
            intrinsics_path: None,
            not_clouds: Vec::new(),
            memory_bytes: Budget::DEFAULT_BYTES,
            scratch: None,
        }
    }
}
