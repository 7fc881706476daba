//! Handling of crashes, damage and interrupted work: recovery, salvage, staging, moves and quarantine.

pub(super) mod moved_map;
pub(super) mod quarantine;
pub(super) mod recover;
pub(super) mod salvage;
pub(super) mod side_folder;
pub(super) mod staged_map;
