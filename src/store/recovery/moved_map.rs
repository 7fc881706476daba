use super::staged_map::{check_is_free, remove_content, remove_unfinished, staging_folder};
use crate::error::{Error, Result};
use crate::store::WriterLock;
use crate::store::commit::checkpoint::TILES_SYNCED_AT_ONCE;
use crate::store::disk::Disk;
use crate::store::layout::Layout;
use crate::store::map_folder;
use crate::store::place;
use crate::store::tile_store::TileStore;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Moves a map that nobody writes to, to a place that is free, and makes all of it durable there, whether the map's
/// writer did so or not ([`UnsyncedDisk`](crate::store::UnsyncedDisk)). As a [`StagedMap`](super::staged_map::StagedMap)
/// the map is there whole, or not at all; each file is synced once, after all have been written.
///
/// `false` if the file system cannot move it there: it is where it was, then. Of each file of a tile the length alone
/// is compared with the log.
///
/// # Errors
///
/// A place that is not free, a map that somebody writes to, a file that is missing or of another length, a disk that
/// refuses. The map is gone, then, unless it was never moved.
pub fn move_map(disk: &Arc<dyn Disk>, map: &Path, folder: &Path) -> Result<bool> {
    place::check_place(&**disk, folder)?;
    check_is_free(&**disk, folder)?;
    let unfinished = staging_folder(folder)?;
    remove_all(&**disk, &unfinished)?;
    let parent = map_folder::parent_of(folder);
    map_folder::create_folders(&**disk, parent)?;
    // It goes along with the folder, and keeps others from taking that for something left behind.
    let lock = WriterLock::take(&**disk, &Layout::new(map))?;
    if disk.rename(map, &unfinished).is_err() {
        return Ok(false);
    }
    if let Err(error) = finish(disk, &unfinished, folder) {
        let _ = remove_content(&**disk, &Layout::new(&unfinished), true);
        let _ = disk.remove_folder(&unfinished);
        return Err(error);
    }
    drop(lock);
    disk.sync_folder(parent).map_err(|error| Error::io(parent, "sync", error))?;
    Ok(true)
}

fn finish(disk: &Arc<dyn Disk>, unfinished: &Path, folder: &Path) -> Result<()> {
    sync_map(&TileStore::open_read_only(disk.clone(), unfinished)?)?;
    check_is_free(&**disk, folder)?;
    if disk.kind_at(folder)?.is_some() {
        disk.remove_folder(folder).map_err(|error| Error::io(folder, "replace", error))?;
    }
    disk.rename(unfinished, folder).map_err(|error| Error::io(unfinished, "rename", error))
}

/// Makes the files of a map durable, and their names.
fn sync_map(store: &TileStore) -> Result<()> {
    let (disk, layout) = (&**store.disk(), store.layout());
    let mut own = vec![layout.metadata(), layout.commit_log()];
    if disk.kind_at(&layout.scans())?.is_some() {
        own.push(layout.scans());
    }
    sync_paths(disk, &own, &[])?;
    let mut tiles: Vec<_> = store.tiles().collect();
    tiles.sort_unstable();
    for tiles in tiles.chunks(TILES_SYNCED_AT_ONCE) {
        let mut files = Vec::with_capacity(tiles.len() * layout.files().len());
        for &tile in tiles {
            for &file in layout.files() {
                store.check_length(tile, file)?;
                files.push(layout.current(tile, file));
            }
        }
        let folders: Vec<_> = tiles.iter().map(|&tile| layout.tile_folder(tile)).collect();
        sync_paths(disk, &files, &folders)?;
    }
    sync_paths(disk, &[], &[layout.folder().to_owned()])
}

fn sync_paths(disk: &dyn Disk, files: &[PathBuf], folders: &[PathBuf]) -> Result<()> {
    let [of_files, of_folders] = disk.sync_all(files, folders);
    let paths = files.iter().chain(folders);
    paths
        .zip(of_files.into_iter().chain(of_folders))
        .try_for_each(|(path, synced)| synced.map_err(|error| Error::io(path, "sync", error)))
}

/// Removes what an interrupted attempt left, with its folder.
fn remove_all(disk: &dyn Disk, unfinished: &Path) -> Result<()> {
    if disk.kind_at(unfinished)?.is_none() {
        return Ok(());
    }
    remove_unfinished(disk, unfinished)?;
    remove_content(disk, &Layout::new(unfinished), true)?;
    disk.remove_folder(unfinished).map_err(|error| Error::io(unfinished, "remove", error))
}
