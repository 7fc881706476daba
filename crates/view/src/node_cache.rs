use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};
use voxtile_render::levels::NodeStore;

/// Maximum size of the file. A larger file is emptied, because most of its nodes belong to obsolete states.
const MAX_BYTES: u64 = 4 << 30;

/// Opens the store of a map's coarse nodes: in the user's cache folder by the map's id, or else in a temporary file if
/// there is no such folder, another process uses the file, or caching is off.
pub fn open(map_id: Option<&str>) -> Result<NodeStore> {
    if let Some(path) = map_id.and_then(path_of) {
        match open_kept(&path) {
            Ok(Some(file)) => match open_limited(file, &path) {
                Ok(store) => return Ok(store),
                Err(error) => log::warn!("{error:#}; levels are not cached"),
            },
            Ok(None) => log::info!("{} is in use; levels are not cached", path.display()),
            Err(error) => log::info!("{}: {error}; levels are not cached", path.display()),
        }
    }
    let (file, folder) = temporary_file()?;
    open_limited(file, &folder)
}

/// Opens a store in a temporary file that keeps all nodes.
pub fn temporary() -> Result<NodeStore> {
    let (file, folder) = temporary_file()?;
    NodeStore::open(file, folder)
}

/// Returns an unnamed file and its folder.
fn temporary_file() -> Result<(File, PathBuf)> {
    let folder = std::env::temp_dir();
    match tempfile::tempfile() {
        Ok(file) => Ok((file, folder)),
        Err(error) => Err(Error::io(&folder, "create a temporary file in", error)),
    }
}

/// Opens a store with a limited file size.
fn open_limited(file: File, path: &Path) -> Result<NodeStore> {
    let same = file.try_clone().map_err(|error| Error::io(path, "open", error))?;
    Ok(NodeStore::open(file, path)?.with_limit(MAX_BYTES, move || same.set_len(0)))
}

/// Returns `None` if another process uses the file.
fn open_kept(path: &Path) -> std::io::Result<Option<File>> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
    match file.try_lock() {
        Ok(()) => {}
        Err(std::fs::TryLockError::WouldBlock) => return Ok(None),
        Err(std::fs::TryLockError::Error(error)) => return Err(error),
    }
    if file.metadata()?.len() > MAX_BYTES {
        file.set_len(0)?;
    }
    Ok(Some(file))
}

fn path_of(map_id: &str) -> Option<PathBuf> {
    // The id is read from a file: use it as a file name only if it is well-formed.
    if map_id.is_empty() || !map_id.bytes().all(|letter| letter.is_ascii_hexdigit() || letter == b'-') {
        return None;
    }
    let folder = |name| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let cache = folder("XDG_CACHE_HOME").or_else(|| Some(folder("HOME")?.join(".cache")))?;
    Some(cache.join("voxtile").join(format!("{map_id}.levels")))
}
