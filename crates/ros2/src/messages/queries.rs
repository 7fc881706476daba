use super::Outcome;
use ros2_client::Message;
use serde::{Deserialize, Serialize};
use voxtile::Hit;

/// Request of `voxtile_msgs/CastRay`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RayRequest {
    /// Metres.
    pub origin: [f64; 3],
    /// Any length except 0.
    pub direction: [f64; 3],
    /// Metres; 0 for no limit.
    pub max_range: f64,
    pub unknown_is_obstacle: bool,
}

/// Request of `voxtile_msgs/CheckCollision`: a ball that moves in a straight line.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CollisionRequest {
    /// Metres.
    pub from: [f64; 3],
    pub to: [f64; 3],
    pub radius: f64,
    pub unknown_is_obstacle: bool,
}

/// Response of both requests: the voxel that was hit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HitResponse {
    /// Whether the query succeeded.
    pub outcome: Outcome,
    pub hit: bool,
    /// Center of the voxel, in metres.
    pub center: [f64; 3],
    /// Metres.
    pub distance: f64,
    /// Occupancy probability; -1 for an unknown voxel.
    pub probability: f64,
}

impl Message for RayRequest {}
impl Message for CollisionRequest {}
impl Message for HitResponse {}

impl HitResponse {
    pub fn of(found: voxtile::Result<Option<Hit>>) -> Self {
        let none = |outcome| Self { outcome, hit: false, center: [0.0; 3], distance: 0.0, probability: 0.0 };
        match found {
            Ok(Some(hit)) => Self {
                outcome: Outcome::from(Ok(String::new())),
                hit: true,
                center: hit.center_m,
                distance: hit.distance_m,
                probability: hit.probability.unwrap_or(-1.0),
            },
            Ok(None) => none(Outcome::from(Ok(String::new()))),
            Err(error) => none(Outcome::from(Err(error.to_string()))),
        }
    }
}
