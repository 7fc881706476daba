//! What crashes, damage and interrupted work leave behind: recovered, salvaged, staged, moved or put to quarantine.

pub(super) mod moved_map;
pub(super) mod quarantine;
pub(super) mod recover;
pub(super) mod salvage;
pub(super) mod side_folder;
pub(super) mod staged_map;
