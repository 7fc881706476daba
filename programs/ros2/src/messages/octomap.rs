use super::Header;
use super::sequence::bytes;
use serde::Serialize;

/// `octomap_msgs/Octomap`.
#[derive(Clone, Debug, Serialize)]
pub struct Octomap {
    pub header: Header,
    /// Whether nodes are free or occupied (`.bt`) or have log-odds (`.ot`).
    pub binary: bool,
    /// OctoMap's name of the tree's class.
    pub id: String,
    /// Metres.
    pub resolution: f64,
    /// The nodes alone, without the header of a file.
    #[serde(serialize_with = "bytes")]
    pub data: Vec<u8>,
}
