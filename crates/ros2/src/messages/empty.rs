use ros2_client::Message;
use serde::{Deserialize, Serialize};

/// Request or response without fields. On the wire it has one byte.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Empty {
    structure_needs_at_least_one_member: u8,
}

impl Message for Empty {}
