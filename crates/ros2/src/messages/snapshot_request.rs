use ros2_client::Message;
use serde::{Deserialize, Serialize};

/// The request of `voxtile_msgs/Snapshot`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SnapshotRequest {
    pub name: String,
}

impl Message for SnapshotRequest {}
