//! ROS 2 messages that the node sends and requests that it receives. `serde` encodes the fields as CDR in their order.
//! `docs/ros2.md` defines voxtile's own messages (`voxtile_msgs`).

mod box_request;
mod diagnostic_array;
mod empty;
mod esdf;
mod get_octomap;
mod header;
mod marker_array;
mod occupancy_grid;
mod octomap;
mod outcome;
mod point_cloud2;
mod pose;
mod pose_array;
mod queries;
mod sequence;
mod snapshot_request;

pub use box_request::BoxRequest;
pub use diagnostic_array::{DiagnosticArray, DiagnosticStatus, KeyValue};
pub use empty::Empty;
pub use esdf::{EsdfRequest, EsdfResponse, FloatArray};
pub use get_octomap::{OctomapInBoxRequest, OctomapInBoxResponse, OctomapResponse};
pub use header::{Header, Time};
pub use marker_array::{Color, Marker, MarkerArray};
pub use occupancy_grid::{MapMetaData, OccupancyGrid};
pub use octomap::Octomap;
pub use outcome::Outcome;
pub use point_cloud2::PointCloud2;
pub use pose::Pose;
pub use pose_array::PoseArray;
pub use queries::{CollisionRequest, HitResponse, RayRequest};
pub use snapshot_request::SnapshotRequest;
