use crate::Budget;
use crate::class_selection::{ClassSelection, Returns};
use crate::poses::CloudOptions;
use crate::read::Intrinsics;
use crate::scans::Selection;
use std::path::PathBuf;
use voxtile::scan::AttributeSet;

/// Settings for reading an input; see [`open_scans`](super::open_scans).
#[derive(Clone, Debug)]
pub struct ReadOptions {
    /// Name of the format. `None`: detected.
    pub format: Option<String>,
    /// Columns of a `.bin` file: `x`, `y`, `z`, `intensity` and any others, with units if not in metres (`x_mm`). Each
    /// is a four-byte float, or has the type after a colon (`x:f64`, `ring:u16`). `None`: KITTI's four columns, or
    /// nuScenes' five for a `.pcd.bin`, unless the numbers clearly belong to other columns.
    pub fields: Option<Vec<String>>,
    /// Duration of the scans that a LAS file with GPS times is split into, in seconds. 0: the file is one cloud.
    pub scan_period_s: f64,
    /// Sensor position in the frame of the points, in metres, for registered clouds without poses. Points are then
    /// returned relative to it, and the cloud has it as its pose.
    pub sensor_origin_m: Option<[f64; 3]>,
    /// Depth image units per metre. `None`: 5000 for TUM RGB-D, 1000 (millimetres) otherwise.
    pub depth_scale: Option<f64>,
    /// Camera of depth images.
    pub intrinsics: Option<Intrinsics>,
    /// File with the camera of depth images. `None`: `camera-intrinsics.txt` in the folder or its parent.
    pub intrinsics_path: Option<PathBuf>,
    /// Files of the folder that are not clouds. Files named in other options are excluded anyway.
    pub not_clouds: Vec<PathBuf>,
    /// Settings for recordings.
    pub recording: RecordingOptions,
    /// Pose file, or `identity` if all scans are in the world frame.
    pub poses: Option<PathBuf>,
    /// KITTI `calib.txt`, for poses of the camera.
    pub calib: Option<PathBuf>,
    /// How clouds get their poses.
    pub clouds: CloudOptions,
    /// Selection of scans and points.
    pub selection: Selection,
    /// Attributes of points to read, for the layers of a map. Intensities are always read.
    pub attributes: AttributeSet,
    /// Selection of points by class.
    pub classes: ClassSelection,
    /// Returns of LAS files to read.
    pub returns: Returns,
    /// Memory budget in bytes for data that grows with the input. Data beyond it goes to temporary files.
    pub memory_bytes: usize,
    /// Folder for temporary files. `None`: the system's.
    pub scratch: Option<PathBuf>,
}

impl ReadOptions {
    /// Returns the memory budget and the folder for temporary files.
    pub fn budget(&self) -> Budget {
        Budget { bytes: self.memory_bytes, scratch: self.scratch.clone() }
    }

    /// Returns the attributes that readers need: the wanted ones, and classes to select by.
    pub(crate) fn attributes_to_read(&self) -> AttributeSet {
        let AttributeSet { colours, classes, .. } = self.attributes;
        AttributeSet { colours, classes: classes || !self.classes.is_everything(), ..AttributeSet::NONE }
    }

    /// Returns all files that are not clouds, including those named in other options.
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
            attributes: AttributeSet::NONE,
            classes: ClassSelection::default(),
            returns: Returns::default(),
            memory_bytes: Budget::DEFAULT_BYTES,
            scratch: None,
        }
    }
}

/// Settings for recordings.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordingOptions {
    /// Topic of the clouds. Required if there are several.
    pub topic: Option<String>,
    /// Topic of poses to use instead of `/tf`.
    pub odometry_topic: Option<String>,
    /// Name of the world frame.
    pub fixed_frame: Option<String>,
}
