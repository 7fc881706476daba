//! Operations on whole maps on disk, tile by tile in constant memory.
//!
//! ```text
//! tables, in tile order -> MapWriter -> MAP.unfinished -> MAP
//! merge   k readers, one tile index at a time -> MapWriter
//! crop    one reader -> MapWriter
//! scans_of_part, united_scans, appended_scans   the kept scans of a part, of parts of one build, of maps -> MapWriter
//! import  a file of OctoMap -> MapWriter
//! make_shard, move_shard   a map -> a shard of a future map, by copying or moving
//! join    shards -> MapWriter, by hard links
//! replace_tiles   readers of parts -> MapEditor: replaces tiles of a map -> one commit
//! clear, decay, forget_old   MapEditor: tiles read, changed, written as next versions -> one commit
//! a flush  -> snapshot -> snapshots/NAME; its tables are kept
//! snapshot -> revert   -> one commit
//! kept scans with new poses, or removed -> remapping: affected tiles replayed -> one commit
//! two maps, or snapshots of one, tile by tile -> diff
//! ```
//!
//! `docs/life_of_a_map.md` describes their purpose and rules.

mod appended_scans;
mod clear;
mod convert;
mod crop;
mod decay;
mod diff;
mod forget;
mod import;
mod join;
mod kept_bytes;
mod map_editor;
mod map_writer;
mod merge;
mod merge_rule;
mod part;
mod regions;
mod remapping;
mod replace_tiles;
mod revert;
mod scans_of_part;
mod shard;
mod snapshot;
mod table_change;
mod table_merge;
mod united_scans;

pub use clear::{Cleared, clear};
pub use convert::{CopyScans, convert};
pub use crop::{crop, crop_area, crop_shard};
pub use decay::{Decay, Decayed, decay};
pub use diff::{Diff, TileChange, TileDiff, VoxelDiff, diff};
pub use forget::{Forgotten, MaxAge, forget_old};
pub use import::import;
pub use join::join;
pub use kept_bytes::{KeptBytes, kept_bytes};
pub use map_writer::{MapWriter, WrittenMap};
pub use merge::{Merged, merge};
pub use merge_rule::Prefer;
pub use part::{AreaPart, Part};
pub use remapping::{
    NewMarks, NewPoses, OnlineRemap, PointsInBox, PointsRemoved, Rebuilt, Remap, Remapped, Replay,
    ReplayPart, Replayed, ScanChange, ScanSelection, ScansRemoved, ScansWithout, SnapshotFailure,
    mark_moving, rebuild, rebuild_with_poses, remap, remove_found_points, remove_points, remove_scans,
    replay_columns, replay_part,
};
pub use replace_tiles::{TilesReplaced, replace_tiles};
pub use revert::{Reverted, revert};
pub use shard::{make_shard, move_shard};
pub use snapshot::{SnapshotInfo, delete_snapshot, new_snapshot, snapshot, snapshots};
