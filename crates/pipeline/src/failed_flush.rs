use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use voxtile::mapper::OutOfCoreTileMapper;
use voxtile::{Error, MapConfig, Storage};

/// Cleanup of a map after a failed flush.
pub(crate) struct FailedFlush<'a> {
    pub folder: &'a Path,
    pub config: MapConfig,
    /// Number of scans at the last successful flush.
    pub scan_number: u64,
    /// Whether this build created the map.
    pub is_new: bool,
    /// Whether the map is a shard, which is always rebuilt as a whole.
    pub is_shard: bool,
}

const GONE: &str = "no scan was flushed, and the new map was removed";
/// Files of a map without scans.
const EMPTY_MAP: [&str; 3] = ["metadata.json", "commits.log", "writer.lock"];

impl FailedFlush<'_> {
    /// Removes the uncommitted files of the flush, or the whole map if it is new and empty. The map must be closed.
    /// Returns the error with the state of the map and advice.
    pub fn clean(self, error: Error) -> anyhow::Error {
        let hint = match self.config.storage {
            Storage::OctoMap if is_full(&error) => {
                "a map with `storage` compact takes about a thirtieth of the space"
            }
            _ => "",
        };
        let is_gone = self.remove_leftovers();
        let Self { folder, scan_number, .. } = self;
        let folder = folder.display();
        let context = match (is_gone, hint) {
            (true, "") => format!("{folder}: {GONE}; fix the cause and repeat the command"),
            (true, hint) => format!("{folder}: {GONE}; free disk space, or: {hint}"),
            (false, _) => {
                let hint = if hint.is_empty() { String::new() } else { format!("; {hint}") };
                format!(
                    "{folder}: the map contains the scans up to {scan_number}; fix the cause and continue with the \
                     same command and `resume`{hint}"
                )
            }
        };
        anyhow::Error::new(error).context(context)
    }

    /// Returns whether the map was removed.
    fn remove_leftovers(&self) -> bool {
        if self.is_shard {
            return false;
        }
        // Opening the map removes uncommitted files.
        let reopened = OutOfCoreTileMapper::open(self.folder, self.config.clone());
        let is_open = reopened.inspect_err(|error| log::debug!("{error:#}")).is_ok();
        is_open && self.is_new && self.scan_number == 0 && remove_empty_map(self.folder)
    }
}

/// Removes a map that has no files except those of an empty map. Returns whether it was removed.
fn remove_empty_map(folder: &Path) -> bool {
    let is_own = |name: &std::ffi::OsStr| EMPTY_MAP.iter().any(|own| name == *own);
    let Ok(entries) = fs::read_dir(folder) else { return false };
    let are_own = entries.into_iter().all(|entry| entry.is_ok_and(|entry| is_own(&entry.file_name())));
    if !are_own {
        return false;
    }
    let is_removed = EMPTY_MAP.iter().all(|name| match fs::remove_file(folder.join(name)) {
        Err(error) => error.kind() == ErrorKind::NotFound,
        Ok(()) => true,
    });
    // Fails for a mount point, which remains.
    let _ = fs::remove_dir(folder);
    is_removed
}

/// Returns whether a disk or quota is full.
fn is_full(error: &Error) -> bool {
    let kind = match error {
        Error::Io { cause, .. } => cause.kind(),
        _ => return false,
    };
    matches!(kind, ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge)
}
