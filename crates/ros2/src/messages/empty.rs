use ros2_client::Message;
use serde::{Deserialize, Serialize};

/// A request or a response without fields: it is one octet.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Empty {
    structure_needs_at_least_one_member: u8,
}

impl Message for Empty {}
