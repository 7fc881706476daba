//! Completes changes of scans: removed points must not remain in any file of the map.

use crate::error::{Error, Result};
use crate::store::{Disk, EntryKind, Layout, Metadata, Salvage, SideFolder, TileStore, id_from_hex};
use std::io;
use std::path::Path;
use std::sync::Arc;

/// Finishes the last commit, and durably removes kept scans that are no longer needed.
pub(super) fn release(store: &mut TileStore) -> Result<()> {
    store.checkpoint()?;
    store.release_scans()
}

/// Removes the shadow map of a killed online remap, because it still has the evidence of the scans to remove. A map
/// that happens to have this name has another id and is kept. A killed removal leaves a folder without the files that
/// contain the id.
///
/// # Errors
///
/// A foreign file in the folder, or an I/O error.
pub(super) fn remove_second_map(disk: Arc<dyn Disk>, folder: &Path) -> Result<()> {
    let second = folder.with_added_extension("remapping");
    if !matches!(disk.kind(&second), Ok(Some(EntryKind::Folder))) {
        return Ok(());
    }
    let Some(id) = TileStore::open_read_only(disk.clone(), folder)?.map_id() else { return Ok(()) };
    let layout = Layout::new(&second);
    let has_id = disk.kind_at(&layout.metadata())?.is_some() || disk.kind_at(&layout.commit_log())?.is_some();
    if has_id {
        let remains = Salvage::read(&*disk, &layout)?;
        let id_in = |metadata: &Metadata| id_from_hex(&metadata.ext.as_ref()?.map_id);
        let written = remains.metadata.as_ref().ok().and_then(id_in);
        if remains.log_map_id.or(written) != Some(id) {
            return Ok(());
        }
    }
    match SideFolder::begin(disk, folder) {
        // `Locked`: another process uses the folder. `InvalidArgument`: the map's path has no name, so there can be no
        // such folder.
        Ok(_) | Err(Error::Locked { .. } | Error::InvalidArgument { .. }) => Ok(()),
        // The folder has other content, so it only happens to have this name. It is kept: only folders of maps are
        // removed.
        Err(Error::AlreadyExists { .. }) if !has_id => Ok(()),
        Err(error) => Err(error),
    }
}

/// Completes an interrupted removal, so that removed scans remain only in snapshots. Returns the number of removed
/// files with kept scans. A map without such files is not opened for writing, so another writer is not an error then.
///
/// # Errors
///
/// Damage, an I/O error, or, if files must be removed, another writer.
pub(super) fn complete_earlier(disk: Arc<dyn Disk>, folder: &Path) -> Result<u64> {
    let second = remove_second_map(disk.clone(), folder);
    let idle =
        TileStore::open_read_only(disk.clone(), folder)?.snapshots().idle_scan_files()?.unwrap_or_default();
    match TileStore::open(disk.clone(), folder) {
        // Another writer may have the map open. No files remain, because a writer removes them when it opens the map.
        Err(_) if idle.is_empty() => {}
        opened => opened.and_then(|mut store| release(&mut store)).map_err(with_hint)?,
    }
    second?;
    let mut removed = 0;
    for path in idle {
        removed += u64::from(disk.kind_at(&path)?.is_none());
    }
    Ok(removed)
}

/// Completes a committed removal whose files could not be removed durably.
pub(super) fn complete(disk: Arc<dyn Disk>, folder: &Path) -> Result<()> {
    TileStore::open(disk, folder).and_then(|mut store| release(&mut store)).map_err(with_hint)
}

/// Adds the remedy to the error of an incomplete removal.
fn with_hint(error: Error) -> Error {
    match error {
        Error::Io { path, action, cause } => {
            let hint = "removed points are still in the files of the map; run this again";
            Error::Io { path, action, cause: io::Error::new(cause.kind(), format!("{cause}; {hint}")) }
        }
        Error::Damaged { path, tile, mut cause } => {
            cause.reason.push_str(
                "; removed points are still in the files of the map; repair the map and run this again",
            );
            Error::Damaged { path, tile, cause }
        }
        other => other,
    }
}
