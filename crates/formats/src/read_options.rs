use crate::Budget;
use crate::poses::CloudOptions;
use crate::read::Intrinsics;
use crate::scans::Selection;
use std::path::PathBuf;

/// How an input is read where its files do not say it; see [`open_scans`](super::open_scans).
#[derive(Clone, Debug)]
pub struct ReadOptions {
    /// The name of the format; guessed if `None`.
    pub format: Option<String>,
    /// Columns of a `.bin` file: `x`, `y`, `z`, `intensity`, and any others, with units if not in metres (`x_mm`); each a
    /// float of four bytes, or of the type behind a colon (`x:f64`, `ring:u16`). `None`: KITTI's four, or nuScenes' five
    /// for a `.pcd.bin`, unless the numbers of the file are clearly those of other columns.
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
    /// Files that are no clouds, though they may lie among them. Those that are named above and below are none anyway.
    pub not_clouds: Vec<PathBuf>,
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
    /// Bytes of memory for what grows with the input; beyond them it goes to temporary files.
    pub memory_bytes: usize,
    /// Folder of temporary files; the system's own if `None`.
    pub scratch: Option<PathBuf>,
}

impl ReadOptions {
    /// How much memory reading may take, and where the rest goes.
    pub fn budget(&self) -> Budget {
        Budget { bytes: self.memory_bytes, scratch: self.scratch.clone() }
    }

    /// The files that are no clouds.
    pub(crate) fn not_clouds(&self) -> Vec<PathBuf> {
        let named = [&self.poses, &self.calib, &self.intrinsics_path].into_iter().flatten();
        self.not_clouds.iter().chain(named).cloned().collect()
    }
}

impl Default for ReadOptions {
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
            recording: RecordingOptions::default(),
            poses: None,
            calib: None,
            clouds: CloudOptions::default(),
            selection: Selection::default(),
            memory_bytes: Budget::DEFAULT_BYTES,
            scratch: None,
        }
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
