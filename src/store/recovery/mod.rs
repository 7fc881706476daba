//! What crashes, damage and interrupted work leave behind: recovered, salvaged, staged or moved to quarantine.

pub(super) mod quarantine;
pub(super) mod recover;
pub(super) mod salvage;
pub(super) mod side_folder;
pub(super) mod staged_map;
