use crate::spill::Budget;
use std::path::PathBuf;
use voxtile::scan::AttributeSet;

/// Settings for reading a recording: the clouds and the origin of their poses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BagOptions {
    /// Topic of the clouds. Required if there are several.
    pub topic: Option<String>,
    /// Topic of poses for [`PoseSource::Odometry`]. Required if there are several.
    pub odometry_topic: Option<String>,
    /// Name of the map frame. By default `map`, else `odom`, else the root of the tree that contains the clouds' frame.
    /// With a topic of poses, the frame of those poses.
    pub fixed_frame: Option<String>,
    /// Origin of the poses.
    pub poses: PoseSource,
    /// Maximum time between two poses to interpolate, in nanoseconds; see [`most_gap_ns`](crate::poses::most_gap_ns).
    pub most_gap_ns: Option<i64>,
    /// Whether points are already in the map frame; poses then only give the ray origins.
    pub is_world_frame: bool,
    /// Whether poses are also searched for in topics not named here, for clouds that are already in the map frame.
    pub are_poses_needed: bool,
    /// Attributes of points to read.
    pub attributes: AttributeSet,
    /// Memory budget in bytes for chunks, messages and poses. Data beyond it goes to temporary files.
    pub memory_bytes: usize,
    /// Folder for decompressed and other temporary files. `None`: the system's.
    pub scratch: Option<PathBuf>,
}

impl BagOptions {
    /// Returns the memory budget and the folder for temporary files.
    pub fn budget(&self) -> Budget {
        Budget { bytes: self.memory_bytes, scratch: self.scratch.clone() }
    }
}

impl Default for BagOptions {
    fn default() -> Self {
        Self {
            topic: None,
            odometry_topic: None,
            fixed_frame: None,
            poses: PoseSource::default(),
            most_gap_ns: None,
            is_world_frame: false,
            are_poses_needed: true,
            attributes: AttributeSet::NONE,
            memory_bytes: Budget::DEFAULT_BYTES,
            scratch: None,
        }
    }
}

/// Origin of sensor poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PoseSource {
    /// Transforms of `/tf` and `/tf_static`.
    #[default]
    Tf,
    /// A topic of odometry, poses or a path, combined with the transforms from its child frame to the sensor.
    Odometry,
    /// None; the caller provides poses.
    None,
}
