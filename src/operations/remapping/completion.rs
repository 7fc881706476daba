//! What a change of scans leaves to do: points that are gone from the map must be in none of its files.

use crate::error::{Error, Result};
use crate::store::{Disk, EntryKind, Layout, Metadata, Salvage, SideFolder, TileStore, id_from_hex};
use std::io;
use std::path::Path;
use std::sync::Arc;

/// Does what a commit leaves to do, and removes what nothing needs any more of kept scans, durably.
pub(super) fn release(store: &mut TileStore) -> Result<()> {
    store.checkpoint()?;
    store.release_scans()
}

/// Removes the second map that a remapping beside a mapper left when it was killed: it has the evidence of all scans.
/// Another map that has this name by chance has another id, and stays. A killed removal leaves a folder without the files
/// that have the id.
///
/// # Errors
///
/// A disk that refuses; a file in the second map that is of no map.
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
        // At work, or a path without a name that none could be beside.
        Ok(_) | Err(Error::Locked { .. } | Error::InvalidArgument { .. }) => Ok(()),
        // A folder that has this name by chance: a removal begins only where all is of a map.
        Err(Error::AlreadyExists { .. }) if !has_id => Ok(()),
        Err(error) => Err(error),
    }
}

/// Completes what an earlier call may have left of a removal: what it took out of the map is in no file any more, except
/// for snapshots. Returns how many files with kept scans are gone by this. A map without such files need not be opened
/// for writing, so another writer is no error there.
///
/// # Errors
///
/// Damage, a disk that refuses; with files that are to be gone, another writer.
pub(super) fn complete_earlier(disk: Arc<dyn Disk>, folder: &Path) -> Result<u64> {
    let second = remove_second_map(disk.clone(), folder);
    let idle =
        TileStore::open_read_only(disk.clone(), folder)?.snapshots().idle_scan_files()?.unwrap_or_default();
    match TileStore::open(disk.clone(), folder) {
        // The other writer has done it when it opened the map.
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

/// Completes a removal that was committed and could not remove its files durably.
pub(super) fn complete(disk: Arc<dyn Disk>, folder: &Path) -> Result<()> {
    TileStore::open(disk, folder).and_then(|mut store| release(&mut store)).map_err(with_hint)
}

/// The error of a removal that was not completed, with what to do.
fn with_hint(error: Error) -> Error {
    match error {
        Error::Io { path, action, cause } => {
            let hint = "points that were removed from the map are still in its files; run this again";
            Error::Io { path, action, cause: io::Error::new(cause.kind(), format!("{cause}; {hint}")) }
        }
        Error::Damaged { path, tile, mut cause } => {
            cause.reason.push_str(
                "; points that were removed from the map are still in its files; repair the map, and run this again",
            );
            Error::Damaged { path, tile, cause }
        }
        other => other,
    }
}
