use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

/// What tests may need at once; containers often have 64 MiB.
#[cfg(target_os = "linux")]
const MIN_FREE_BYTES: u64 = 1 << 30;

/// A temporary folder in memory where the system has room for it, else where temporary files are.
///
/// For tests that write and remove thousands of small files: ext4 searches longer for each new inode, the more have been
/// removed in the last seconds. Tests of the file system itself take [`TempDir::new`].
pub fn memory_folder() -> TempDir {
    in_memory().unwrap_or_else(|| TempDir::new().unwrap())
}

/// A temporary folder alone in another: poses and cameras are also searched for next to a folder of scans, where other
/// programs may have theirs. The first is removed when it is dropped.
pub fn lone_folder() -> (TempDir, PathBuf) {
    let outer = TempDir::new().unwrap();
    let folder = outer.path().join("folder");
    fs::create_dir(&folder).unwrap();
    (outer, folder)
}

#[cfg(target_os = "linux")]
fn in_memory() -> Option<TempDir> {
    let room = rustix::fs::statvfs("/dev/shm").ok()?;
    let is_roomy = room.f_bavail.saturating_mul(room.f_frsize) >= MIN_FREE_BYTES;
    is_roomy.then(|| TempDir::new_in("/dev/shm").ok())?
}

#[cfg(not(target_os = "linux"))]
fn in_memory() -> Option<TempDir> {
    None
}
