//! How scans become a map, and how maps are found: what the command, the page, the Python package and the ROS 2 node
//! share. Nothing here prints, parses a command line or knows a screen.

mod answer;
mod map_at;
pub mod octree_file;
pub mod place;

pub use answer::{Answer, answer_at};
pub use map_at::{AnyMap, MapAt, open_any_map, read_all_maps, read_any_map, read_map, read_maps, whole_map};
