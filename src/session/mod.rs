//! What is done with whole maps on disk, tile by tile in constant memory.
//!
//! ```text
//! tables, in tile order -> MapWriter -> MAP.unfinished -> MAP
//! a flush  -> snapshot -> snapshots/NAME, and the tables that it sees stay
//! snapshot -> revert   -> one commit
//! two maps, or snapshots of one, tile by tile -> diff
//! ```

mod convert;
mod diff;
mod map_writer;
mod revert;
mod snapshot;

pub use convert::convert;
pub use diff::{Diff, TileChange, TileDiff, VoxelDiff, diff};
pub use map_writer::{MapWriter, WrittenMap};
pub use revert::{Reverted, revert, revert_on};
pub use snapshot::{
    SnapshotInfo, delete_snapshot, delete_snapshot_on, snapshot, snapshot_on, snapshots, snapshots_on,
};
