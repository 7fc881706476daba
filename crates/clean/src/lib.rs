//! Marks the points of a map's kept scans that hit something that moved, such as a car, a walker or a door.
//!
//! ```text
//! kept scans      -> temporary map of them in reverse order                   scan_map
//! kept scans, maps -> voxels that a scan hits and a map calls free       seen_through
//!                 -> of these, the ones that many scans hit: parked things     stays
//!                 -> share of such voxels around each point -> marks     neighborhood, find_moving
//!                 -> marks of all scans, in a temporary file             search, marks_file
//!                 -> replay of the affected tiles, one commit            clean, undo
//! ```
//!
//! A voxel that a scan hits and that a map calls free was seen through by other scans: by later ones if the map calls it
//! free, by earlier ones if the reversed map does. A single one is often an error at the border of a surface. The hits on
//! a moving body are seen through nearly everywhere, so each point is judged by the voxels around it that the same scan
//! hits.

mod clean;
mod find_moving;
mod marks_file;
mod neighborhood;
mod scan_hits;
mod scan_map;
mod search;
mod search_parts;
mod seen_through;
mod stays;
mod temporary_map;
mod undo;

pub use clean::{Clean, Cleaned, Phase, clean};
pub use scan_map::Order;
pub use search_parts::{
    AllMarks, FoundMarks, SearchMaps, clean_found, count_column, map_column, search_columns,
};
pub use undo::{undo, unmarked};
