use ros2_client::Message;
use serde::{Deserialize, Serialize};

/// Request of `voxtile_msgs/Snapshot`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SnapshotRequest {
    pub name: String,
}

impl Message for SnapshotRequest {}
