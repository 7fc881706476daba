//! Messages that the node sends, as ROS 2 defines them; `serde` makes CDR of them, in the order of their fields.

mod header;
mod marker_array;
mod occupancy_grid;
mod octomap;
mod point_cloud2;
mod pose;
mod sequence;

pub use header::{Header, Time};
pub use marker_array::{Color, Marker, MarkerArray};
pub use occupancy_grid::{MapMetaData, OccupancyGrid};
pub use octomap::Octomap;
pub use point_cloud2::PointCloud2;
pub use pose::Pose;
