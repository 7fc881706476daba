//! Publishers of the map, on topics with the names of octomap_server.
//!
//! ```text
//! LiveMap -> LiveView -> octomap, occupied_voxels, projected_map -> messages
//! occupied_voxels -> VoxelChanges -> Viewers -> Changing: sends changes
//! LocalView -> local_obstacles -> messages
//! LiveMap -> LiveDistances -> distance_field -> messages, in a thread of its own
//! LiveMap -> LiveView -> frontiers -> messages, in a thread of its own
//! Health, Counters -> diagnostics
//! Publishing: one thread for the other topics, concurrent with the mapper; Outlet: a topic and the last sent version
//! ```

mod bounded_file;
mod changing;
mod diagnosing;
mod diagnostics;
mod distance_field;
mod extent;
mod frontiers;
mod local_obstacles;
mod occupied_voxels;
mod octomap;
mod outlet;
mod projected_map;
mod publishing;
mod viewers;
mod voxel_changes;

pub use distance_field::DistancePublisher;
pub use extent::Extent;
pub use frontiers::FrontierPublisher;
pub use octomap::{class_of, format_of, octomap};
pub use publishing::{PUBLISHED_CLOUDS, Publishing};
