//! What several subjects share.

pub mod faulty_disk;
pub mod random_scans;
pub mod reference_local;
pub mod reference_map;
pub mod unsynced_disk;

use std::path::{Path, PathBuf};

/// A folder of the data that is too large for the repository: under `$VOXTILE_DATA`, by default `../shared/data`
/// beside the repository. `None`, after saying so, where it is absent.
pub fn shared_data(folder: &str) -> Option<PathBuf> {
    let root = std::env::var_os("VOXTILE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let path = root.join(folder);
    if path.is_dir() {
        return Some(path);
    }
    println!("skipped: there is no {} (VOXTILE_DATA may name another folder)", path.display());
    None
}
