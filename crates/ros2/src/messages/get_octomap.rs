use super::{Octomap, Outcome};
use ros2_client::Message;
use serde::{Deserialize, Serialize};

/// Response of `octomap_msgs/GetOctomap`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OctomapResponse {
    pub map: Octomap,
}

/// Request of `voxtile_msgs/GetOctomapInBox`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OctomapInBoxRequest {
    /// Corners in metres.
    pub min: [f64; 3],
    pub max: [f64; 3],
    /// True for nodes that are free or occupied, false for nodes with log-odds.
    pub binary: bool,
}

/// Response of `voxtile_msgs/GetOctomapInBox`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OctomapInBoxResponse {
    pub outcome: Outcome,
    pub map: Octomap,
}

impl Message for OctomapResponse {}
impl Message for OctomapInBoxRequest {}
impl Message for OctomapInBoxResponse {}
