//! Files of changes between two maps.
//!
//! ```text
//! Comparison -> write_change_list: a row per change      list
//!            -> write_changed_voxels: a row per voxel    voxels
//! ComparedMap -> warnings_of: doubts about the result    warnings
//! AnyMap -> SensorPositions, viewpoints_of               viewpoints
//! ```

mod compared_map;
mod list;
mod viewpoints;
mod voxels;
mod warnings;

pub use compared_map::ComparedMap;
pub use list::{ListFormat, change_features, write_change_list};
pub use viewpoints::{SensorPositions, kept_viewpoints, viewpoints_of};
pub use voxels::{WhichChanges, changes_format, class_code, write_changed_voxels};
pub use warnings::{check_crs, common_voxels, warnings_of};
