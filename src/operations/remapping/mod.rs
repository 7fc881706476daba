//! Changes of scans after mapping: new poses, removal of scans or points, marks of moving points. Affected tiles are replayed.
//!
//! ```text
//! change of scans -> revision: affected tiles -> replay of all scans in these tiles, in order -> one commit
//! new poses -> remap_columns -> remap_part by several processes, each into a shard -> join_remap: one commit
//! ```
//!
//! Afterwards the map equals, bit by bit, a map built from the changed scans: the content of a tile depends only on the
//! scans that touch it.

mod completion;
mod filtered_scan;
mod mark_moving;
mod new_poses;
mod online_remap;
mod rebuild;
mod remap;
mod remap_in_parts;
mod remove_points;
mod remove_scans;
mod replay;
mod retiling;
mod revision;

pub use mark_moving::mark_moving;
pub use new_poses::NewPoses;
pub use online_remap::OnlineRemap;
pub use rebuild::{Rebuilt, ScansWithout, rebuild, rebuild_with_poses};
pub use remap::{Remap, Remapped, remap};
pub use remap_in_parts::{RemapPart, join_remap, remap_columns, remap_part};
pub use remove_points::{PointsRemoved, remove_points};
pub use remove_scans::{ScanSelection, ScansRemoved, SnapshotFailure, remove_scans};
pub use replay::{Replay, Replayed};
