use crate::spill::Budget;
use std::path::PathBuf;

/// Which clouds of a recording are read, and where their poses come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BagOptions {
    /// The topic of the clouds; needed if there are several.
    pub topic: Option<String>,
    /// The topic of poses, for [`PoseSource::Odometry`]; needed if there are several.
    pub odometry_topic: Option<String>,
    /// The frame of the map. By default `map`, else `odom`, else the root of the tree that the clouds' frame is in;
    /// with poses of a topic, the frame of these.
    pub fixed_frame: Option<String>,
    /// Where poses come from.
    pub poses: PoseSource,
    /// Between two poses further apart in time there is none; see [`most_gap_ns`](crate::poses::most_gap_ns).
    pub most_gap_ns: Option<i64>,
    /// Points are in the frame of the map already; poses only say from where they were seen.
    pub is_world_frame: bool,
    /// Whether poses are looked for in other topics than those that are named, for clouds that are in the frame of the
    /// map already.
    pub are_poses_needed: bool,
    /// Bytes of memory for chunks, messages and poses; beyond them they go to temporary files.
    pub memory_bytes: usize,
    /// Folder that compressed files are unpacked into, and of other temporary files; the system's own if `None`.
    pub scratch: Option<PathBuf>,
}

impl BagOptions {
    /// How much memory reading may take, and where the rest goes.
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
            memory_bytes: Budget::DEFAULT_BYTES,
            scratch: None,
        }
    }
}

/// Where the poses of the sensor come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PoseSource {
    /// The transforms of `/tf` and `/tf_static`.
    #[default]
    Tf,
    /// A topic of odometry, poses or a path, with the transforms from there to the sensor on top.
    Odometry,
    /// Nowhere: the caller knows them.
    None,
}
