use super::Header;
use super::sequence;
use serde::{Deserialize, Serialize};

/// `octomap_msgs/Octomap`.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Octomap {
    pub header: Header,
    /// True if nodes are free or occupied (`.bt`), false if they have log-odds (`.ot`).
    pub binary: bool,
    /// Class name of the tree in OctoMap.
    pub id: String,
    /// Voxel size in metres.
    pub resolution: f64,
    /// Nodes without the header of a file.
    #[serde(with = "sequence")]
    pub data: Vec<u8>,
}
