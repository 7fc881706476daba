use ros2_client::Message;
use serde::{Deserialize, Serialize};
use voxtile::Aabb;

/// Request of `octomap_msgs/BoundingBoxQuery`: two corners in metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BoxRequest {
    pub min: [f64; 3],
    pub max: [f64; 3],
}

impl Message for BoxRequest {}

impl BoxRequest {
    pub fn region(&self) -> Aabb {
        Aabb { min: self.min, max: self.max }
    }
}
