//! Operations on the folder of a map: `metadata.json`, `commits.log` and the list of tile folders.

use super::commit::commit_log::CommitLog;
use super::commit::commits::Commits;
use super::commit::metadata::Metadata;
use super::disk::{Disk, DiskRead};
use super::layout::{Layout, tile_of_folder};
use crate::error::{DecodeError, Error, FormatError, Result};
use crate::space::TileIndex;
use rustc_hash::FxHashSet;
use std::io::{self, Write};
use std::path::Path;

/// Checks that a folder for a new map is empty except for the remains of an interrupted creation.
pub(super) fn check_is_free(disk: &dyn Disk, folder: &Path) -> Result<()> {
    let names = disk.list(folder).map_err(|error| Error::io(folder, "list", error))?;
    let leftovers = ["writer.lock", "commits.log", "metadata.json.next"];
    if names.iter().all(|name| leftovers.contains(&name.as_str())) {
        return Ok(());
    }
    let hint = "open it, use `append` to add scans, or choose an empty folder";
    Err(Error::AlreadyExists { path: folder.to_owned(), hint })
}

/// Creates a folder and its missing parents durably, so that a map cannot disappear with the name of its folder.
pub(super) fn create_folders(disk: &dyn Disk, folder: &Path) -> Result<()> {
    let Some(parent) = folder.parent() else { return Ok(()) };
    let is_relative_end = parent.as_os_str().is_empty();
    let parent = parent_of(folder);
    let is_there = disk.kind_at(folder)?.is_some();
    if !is_relative_end {
        create_folders(disk, parent)?;
    }
    if is_there {
        // An earlier attempt may have failed to sync. Folders of other users may refuse the sync, so errors are
        // ignored.
        let _ = disk.sync_folder(parent);
        return Ok(());
    }
    disk.create_folder(folder).map_err(|error| Error::io(folder, "create", error))?;
    disk.sync_folder(parent).map_err(|error| {
        // If the folder remained, the next attempt would assume that its name is durable.
        let _ = disk.remove_folder(folder);
        Error::io(parent, "sync", error)
    })
}

/// The parent folder; `.` if the path has none.
pub(super) fn parent_of(folder: &Path) -> &Path {
    match folder.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Replaces a file atomically: `write` creates and syncs `*.next`, which is then renamed. The name is durable after the
/// next sync of the folder.
pub(super) fn replace<T>(
    disk: &dyn Disk,
    path: &Path,
    write: impl FnOnce(&Path) -> io::Result<T>,
) -> Result<T> {
    let next = path.with_added_extension("next");
    let replaced = || {
        let written = write(&next)?;
        disk.rename(&next, path)?;
        Ok(written)
    };
    replaced().map_err(|error| {
        // Remove the incomplete file now: there may be no later attempt that would replace it.
        let _ = disk.remove_file(&next);
        Error::io(path, "replace", error)
    })
}

/// Removes the folder of a tile that is not part of the map. A folder that contains other files, perhaps with names
/// that are not UTF-8, is kept, and the removals in it are made durable.
pub(super) fn remove_unless_used(disk: &dyn Disk, folder: &Path) -> io::Result<()> {
    match disk.remove_folder(folder) {
        Err(error) if error.kind() == io::ErrorKind::DirectoryNotEmpty => disk.sync_folder(folder),
        removed => removed,
    }
}

pub(super) fn write_text(disk: &dyn Disk, path: &Path, text: &str) -> io::Result<()> {
    let mut out = disk.create(path)?;
    out.write_all(text.as_bytes())?;
    out.sync()
}

pub(super) fn read_metadata(disk: &dyn Disk, layout: &Layout) -> Result<Metadata> {
    let path = layout.metadata();
    match disk.open(&path) {
        Ok(mut input) => metadata_from(&mut *input, &path),
        Err(error) => Err(without_metadata(disk, layout, error)),
    }
}

/// Reads `metadata.json` and registers as its reader until the returned file is dropped.
pub(super) fn read_metadata_shared(
    disk: &dyn Disk,
    layout: &Layout,
) -> Result<(Metadata, Box<dyn DiskRead>)> {
    let path = layout.metadata();
    match disk.open_shared(&path) {
        Ok(mut input) => Ok((metadata_from(&mut *input, &path)?, input)),
        Err(error) => Err(without_metadata(disk, layout, error)),
    }
}

fn metadata_from(input: &mut dyn DiskRead, path: &Path) -> Result<Metadata> {
    // Files of this version are below 1 MiB. Earlier versions wrote larger ones for many inputs with long names.
    const LIMIT: u64 = 64 << 20;
    if input.file_bytes() > LIMIT {
        return Err(FormatError::at_offset(LIMIT, "too long for a map's metadata").in_map(path, None));
    }
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes).map_err(|error| Error::io(path, "read", error))?;
    let text = String::from_utf8(bytes).map_err(|error| {
        FormatError::at_offset(error.utf8_error().valid_up_to() as u64, "not UTF-8 text").in_map(path, None)
    })?;
    Metadata::from_text(&text).map_err(|error| DecodeError::from(error).in_map(path, None))
}

/// Returns the error for a missing `metadata.json`: damage if the folder contains tiles, otherwise no map.
fn without_metadata(disk: &dyn Disk, layout: &Layout, error: io::Error) -> Error {
    let path = layout.metadata();
    if error.kind() != io::ErrorKind::NotFound {
        return Error::io(&path, "open", error);
    }
    let names = disk.list(layout.folder()).unwrap_or_default();
    if names.iter().any(|name| tile_of_folder(name).is_some()) {
        let reason = "the file is missing, but the folder contains tiles";
        return FormatError::at_offset(0, reason).in_map(&path, None);
    }
    Error::NoMap { path: layout.folder().to_owned() }
}

/// Reads `commits.log`; `None` if it does not exist.
///
/// # Errors
///
/// Damage or an I/O error.
pub fn read_log(disk: &dyn Disk, layout: &Layout) -> Result<Option<(CommitLog, Commits)>> {
    let path = layout.commit_log();
    match disk.open(&path) {
        Ok(input) => {
            let bytes = input.file_bytes();
            let mut input = io::BufReader::new(input);
            CommitLog::read(&mut input, bytes).map(Some).map_err(|error| error.in_map(&path, None))
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(Error::io(&path, "open", error)),
    }
}

/// Lists the tiles of a map of the original format, which has no log.
pub(super) fn list_foreign_tiles(disk: &dyn Disk, layout: &Layout) -> Result<FxHashSet<TileIndex>> {
    let names = disk.list(layout.folder()).map_err(|error| Error::io(layout.folder(), "list", error))?;
    let mut tiles = FxHashSet::default();
    for tile in names.iter().filter_map(|name| tile_of_folder(name)) {
        // Any content makes a folder a tile, even without a table. An empty folder belongs to a tile that was never
        // flushed.
        let folder = layout.tile_folder(tile);
        match disk.list(&folder) {
            Ok(names) if names.is_empty() => {}
            Err(error) if error.kind() != io::ErrorKind::NotADirectory => {
                return Err(Error::io(&folder, "list", error));
            }
            _ => {
                tiles.insert(tile);
            }
        }
    }
    Ok(tiles)
}
