//! Commits: next versions of tiles, one synced record in `commits.log`, and the steps after it.

pub(super) mod checkpoint;
pub(super) mod commit_log;
pub(super) mod commit_record;
pub(super) mod commits;
pub(super) mod committer;
pub(super) mod flush;
pub(super) mod input_record;
pub(super) mod linked_tiles;
pub(super) mod metadata;
mod tile_transfer;
