//! What the tests share.

pub mod random_scans;
pub mod reference_map;

use std::path::PathBuf;

/// A folder of real data: below `VOXTILE_DATA`, or `../shared/data` beside the project. Without it the test says that
/// it is skipped.
pub fn data(name: &str) -> Option<PathBuf> {
    let default = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let path = std::env::var_os("VOXTILE_DATA").map_or(default, PathBuf::from).join(name);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: no {}", path.display());
    None
}
