//! Verification and repair of a map on disk.
//!
//! ```text
//! verify  metadata.json, commits.log, then tile by tile: table, octree; then snapshots  -> findings
//! repair  index (metadata.json, commits.log) from the remaining files                   -> actions
//!         lists of scans: the readable part
//!         tile by tile: octree from its table, table from a kept one, damaged tiles to quarantine/
//! ```
//!
//! Both need memory for the list of tiles and one tile. `docs/durability.md` states the guarantees.

mod finding;
mod kept_points;
mod kept_scans;
mod rebuild;
mod rechecks;
mod repair;
mod repair_kept_scans;
mod repair_snapshots;
mod snapshots;
mod surroundings;
mod tile_check;
mod verify;

pub use finding::{Finding, Severity};
pub use repair::{Action, ActionKind, Repair, repair};
pub use verify::{Verification, VerifyScope, verify, verify_scope};
