//! Changes of scans after mapping: new poses, removal of scans or points, marks of moving points. Affected tiles are replayed.
//!
//! ```text
//! change of scans -> revision: affected tiles -> replay of all scans in these tiles, in order -> one commit
//! change -> replay_columns -> replay_part by several processes, each into a shard -> replay of finished parts: one commit
//! ```
//!
//! Afterwards the map equals, bit by bit, a map built from the changed scans: the content of a tile depends only on the
//! scans that touch it.

mod change;
mod completion;
mod filtered_scan;
mod finished_parts;
mod mark_moving;
mod new_poses;
mod online_remap;
mod points_in_box;
mod rebuild;
mod remap;
mod remove_points;
mod remove_scans;
mod replay;
mod replay_part;
mod retiling;
mod revision;
mod scan_change;

pub use mark_moving::mark_moving;
pub use new_poses::NewPoses;
pub use online_remap::OnlineRemap;
pub use points_in_box::PointsInBox;
pub use rebuild::{Rebuilt, ScansWithout, rebuild, rebuild_with_poses};
pub use remap::{Remap, Remapped, remap};
pub use remove_points::{PointsRemoved, remove_found_points, remove_points};
pub use remove_scans::{ScanSelection, ScansRemoved, SnapshotFailure, remove_scans};
pub use replay::{Replay, Replayed};
pub use replay_part::{ReplayPart, replay_columns, replay_part};
pub use scan_change::{NewMarks, ScanChange};
