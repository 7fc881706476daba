//! Maps that follow their scans: poses move, scans or points go, and what that touches is mapped again.
//!
//! ```text
//! change of scans -> revision: which tiles? -> those tiles, from all scans that touch them, in order -> one commit
//! ```
//!
//! The map is afterwards as if it had been built from the scans as they are now, to the bit: a tile depends on the
//! scans that touch it, and on nothing else.

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
