//! What the node publishes of the map, under the names of octomap_server.
//!
//! ```text
//! LiveMap -> LiveView -> octomap, occupied_voxels, projected_map -> messages
//! Health, Counters -> diagnostics
//! Publishing: one thread beside the mapper; Outlet: a topic, and what was sent last
//! ```

mod bounded_file;
mod diagnosing;
mod diagnostics;
mod extent;
mod occupied_voxels;
mod octomap;
mod outlet;
mod projected_map;
mod publishing;

pub use extent::Extent;
pub use octomap::octomap;
pub use publishing::Publishing;
