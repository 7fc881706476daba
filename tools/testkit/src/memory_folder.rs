use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

/// Minimum free space; containers often have only 64 MiB.
#[cfg(target_os = "linux")]
const MIN_FREE_BYTES: u64 = 1 << 30;

/// Creates a temporary folder in memory if there is enough space, else in the usual place.
///
/// For tests that write and remove thousands of small files: ext4 searches longer for a new inode the more were removed
/// in the last seconds. Tests of the file system itself use [`TempDir::new`].
pub fn memory_folder() -> TempDir {
    in_memory().unwrap_or_else(|| TempDir::new().unwrap())
}

/// Creates a temporary folder alone in another one. Poses and cameras are also searched next to a folder of scans,
/// where other programs may have files. The outer folder is removed on drop.
pub fn lone_folder() -> (TempDir, PathBuf) {
    let outer = TempDir::new().unwrap();
    let folder = outer.path().join("folder");
    fs::create_dir(&folder).unwrap();
    (outer, folder)
}

#[cfg(target_os = "linux")]
fn in_memory() -> Option<TempDir> {
    let space = rustix::fs::statvfs("/dev/shm").ok()?;
    let is_enough = space.f_bavail.saturating_mul(space.f_frsize) >= MIN_FREE_BYTES;
    is_enough.then(|| TempDir::new_in("/dev/shm").ok())?
}

#[cfg(not(target_os = "linux"))]
fn in_memory() -> Option<TempDir> {
    None
}
