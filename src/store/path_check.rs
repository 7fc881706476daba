use super::disk::{Disk, EntryKind};
use super::fs_disk::FsDisk;
use super::layout::{Layout, tile_of_folder};
use super::map_folder::read_metadata;
use crate::error::{Error, Result};
use std::path::Path;

/// Checks that a path is outside of any map, following symbolic links. A file or folder inside a map would be treated
/// as a part of that map, or be removed by its next writer.
///
/// # Errors
///
/// [`Error::InvalidArgument`] if the path is in a map at any depth, or an I/O error.
pub fn check_outside_of_maps(path: &Path) -> Result<()> {
    check_path(&FsDisk, path)
}

pub(super) fn check_path(disk: &dyn Disk, path: &Path) -> Result<()> {
    if path.to_str().is_some_and(|path| path.contains("://")) {
        let reason = format!(
            "{} is a URL; create the map in a local folder and upload it with `voxtile push`",
            path.display()
        );
        return Err(Error::argument("output", reason));
    }
    let resolved = disk.resolve(path).map_err(|error| Error::io(path, "resolve", error))?;
    for outer in resolved.ancestors().skip(1) {
        if is_map(disk, outer)? {
            let reason = format!(
                "{} is inside the map {}; choose a path outside of it",
                path.display(),
                outer.display()
            );
            return Err(Error::argument("output", reason));
        }
    }
    Ok(())
}

/// Other programs also write files named `metadata.json`, so the content or the neighbouring files must be those of a
/// map.
fn is_map(disk: &dyn Disk, folder: &Path) -> Result<bool> {
    let layout = Layout::new(folder);
    let metadata = layout.metadata();
    let kind = disk.kind_at(&metadata)?;
    if !matches!(kind, Some(EntryKind::File(_))) {
        return Ok(false);
    }
    let has_tiles =
        || disk.list(folder).is_ok_and(|names| names.iter().any(|name| tile_of_folder(name).is_some()));
    let has_log = || disk.kind(&layout.commit_log()).is_ok_and(|kind| kind.is_some());
    Ok(has_log() || has_tiles() || read_metadata(disk, &layout).is_ok())
}
