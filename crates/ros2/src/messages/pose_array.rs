use super::{Header, Pose};
use serde::Serialize;

/// `geometry_msgs/PoseArray`.
#[derive(Clone, Debug, Serialize)]
pub struct PoseArray {
    pub header: Header,
    pub poses: Vec<Pose>,
}
