//! What the node publishes of the map, under the names of octomap_server.
//!
//! ```text
//! LiveMap -> LiveView -> octomap, occupied_voxels, projected_map -> messages
//! occupied_voxels -> VoxelChanges -> Viewers -> Changing: what they do not know yet
//! LocalView -> local_obstacles -> messages
//! Health, Counters -> diagnostics
//! Publishing: one thread beside the mapper; Outlet: a topic, and what was sent last
//! ```

mod bounded_file;
mod changing;
mod diagnosing;
mod diagnostics;
mod extent;
mod local_obstacles;
mod occupied_voxels;
mod octomap;
mod outlet;
mod projected_map;
mod publishing;
mod viewers;
mod voxel_changes;

pub use extent::Extent;
pub use octomap::octomap;
pub use publishing::Publishing;
