use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};
use voxtile_render::levels::NodeStore;

/// A file that would get larger than this is begun anew: most of it is of states that nobody looks at any more.
const MAX_BYTES: u64 = 4 << 30;

/// Where the coarse nodes of a map are kept: in the user's cache folder, under the map's id, or in a file that goes
/// with the program where there is no such folder, another program has it, or nothing is to be kept.
pub fn open(map_id: Option<&str>) -> Result<NodeStore> {
    if let Some(path) = map_id.and_then(path_of) {
        match open_kept(&path) {
            Ok(Some(file)) => match open_limited(file, &path) {
                Ok(store) => return Ok(store),
                Err(error) => log::warn!("{error:#}; nothing is kept for the next time"),
            },
            Ok(None) => log::info!("{} is in use; nothing is kept for the next time", path.display()),
            Err(error) => log::info!("{}: {error}; nothing is kept for the next time", path.display()),
        }
    }
    let folder = std::env::temp_dir();
    let file =
        tempfile::tempfile().map_err(|error| Error::io(&folder, "create a temporary file in", error))?;
    open_limited(file, &folder)
}

/// A store that begins its file anew before it gets too large.
fn open_limited(file: File, path: &Path) -> Result<NodeStore> {
    let same = file.try_clone().map_err(|error| Error::io(path, "open", error))?;
    Ok(NodeStore::open(file, path)?.with_limit(MAX_BYTES, move || same.set_len(0)))
}

/// `None` if another program has it.
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
    // An id comes from a file: it names a file only if it is what ids are.
    if map_id.is_empty() || !map_id.bytes().all(|letter| letter.is_ascii_hexdigit() || letter == b'-') {
        return None;
    }
    let folder = |name| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let cache = folder("XDG_CACHE_HOME").or_else(|| Some(folder("HOME")?.join(".cache")))?;
    Some(cache.join("voxtile").join(format!("{map_id}.levels")))
}
