//! Changes of scans after mapping: new poses, and removal of scans or points. Affected tiles are replayed.
//!
//! ```text
//! change of scans -> revision: affected tiles -> replay of all scans in these tiles, in order -> one commit
//! ```
//!
//! Afterwards the map equals, bit by bit, a map built from the changed scans: the content of a tile depends only on the
//! scans that touch it.

mod completion;
mod filtered_scan;
mod map_anew;
mod new_poses;
mod remap;
mod remap_beside;
mod remove_points;
mod remove_scans;
mod retiling;
mod revision;
mod rework;

pub use map_anew::{MappedAnew, map_anew};
pub use new_poses::NewPoses;
pub use remap::{Remap, Remapped, remap};
pub use remap_beside::RemapBeside;
pub use remove_points::{PointsRemoved, remove_points};
pub use remove_scans::{ScanSelection, ScansRemoved, SnapshotFailure, remove_scans};
pub use rework::{MappedAgain, Rework};
