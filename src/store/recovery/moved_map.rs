use super::staged_map::{check_is_free, remove_content, staging_folder};
use crate::error::{Error, Result};
use crate::space::TileIndex;
use crate::store::WriterLock;
use crate::store::commit::checkpoint::TILES_SYNCED_AT_ONCE;
use crate::store::disk::Disk;
use crate::store::layout::Layout;
use crate::store::map_folder;
use crate::store::path_check;
use crate::store::tile_store::TileStore;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Moves a map without a writer to an unused path and makes it durable there, even if its own writes were not synced
/// ([`UnsyncedDisk`](crate::store::UnsyncedDisk)). The move is atomic, as with
/// [`StagedMap`](super::staged_map::StagedMap), and each file is synced once.
///
/// Returns `false`, with the map unchanged, if the file system cannot move it, or if a killed attempt left a folder at
/// the staging path. Only the lengths of tiles' files are compared with the log.
///
/// # Errors
///
/// An existing destination, a map with a writer, a file that is missing or of another length, or an I/O error. If the
/// error occurs after the map was renamed, the map is deleted.
pub fn move_map(disk: &Arc<dyn Disk>, map: &Path, folder: &Path) -> Result<bool> {
    path_check::check_path(&**disk, folder)?;
    check_is_free(&**disk, folder)?;
    let unfinished = staging_folder(folder)?;
    let parent = map_folder::parent_of(folder);
    map_folder::create_folders(&**disk, parent)?;
    // The lock moves with the folder and protects it from being removed as the remains of an interrupted attempt.
    let lock = WriterLock::take(&**disk, &Layout::new(map))?;
    let store = TileStore::open_read_only(disk.clone(), map)?;
    let mut tiles: Vec<_> = store.tiles().iter().collect();
    tiles.sort_unstable();
    for &tile in &tiles {
        store.layout().files().iter().try_for_each(|&file| store.check_length(tile, file))?;
    }
    if disk.rename(map, &unfinished).is_err() {
        return Ok(false);
    }
    let layout = Layout::new(&unfinished).with_storage(store.layout().storage());
    if let Err(error) = sync_map(&**disk, &layout, &tiles).and_then(|()| finish(&**disk, &unfinished, folder))
    {
        let _ = remove_content(&**disk, &layout, true);
        let _ = disk.remove_folder(&unfinished);
        return Err(error);
    }
    drop(lock);
    disk.sync_folder(parent).map_err(|error| Error::io(parent, "sync", error))?;
    Ok(true)
}

/// Makes the files of a map and their names durable.
fn sync_map(disk: &dyn Disk, layout: &Layout, tiles: &[TileIndex]) -> Result<()> {
    let mut own = vec![layout.metadata(), layout.commit_log()];
    if disk.kind_at(&layout.scans())?.is_some() {
        own.push(layout.scans());
    }
    let kept_scans = layout.kept_scans();
    let keeps_scans = disk.kind_at(&kept_scans)?.is_some();
    if keeps_scans {
        let names = disk.list(&kept_scans).map_err(|error| Error::io(&kept_scans, "list", error))?;
        own.extend(names.iter().map(|name| kept_scans.join(name)));
    }
    sync_paths(disk, &own, if keeps_scans { std::slice::from_ref(&kept_scans) } else { &[] })?;
    for tiles in tiles.chunks(TILES_SYNCED_AT_ONCE) {
        let files = tiles.iter().flat_map(|&tile| layout.files().iter().map(move |&file| (tile, file)));
        let files: Vec<_> = files.map(|(tile, file)| layout.current(tile, file)).collect();
        let folders: Vec<_> = tiles.iter().map(|&tile| layout.tile_folder(tile)).collect();
        sync_paths(disk, &files, &folders)?;
    }
    sync_paths(disk, &[], &[layout.folder().to_owned()])
}

fn finish(disk: &dyn Disk, unfinished: &Path, folder: &Path) -> Result<()> {
    check_is_free(disk, folder)?;
    if disk.kind_at(folder)?.is_some() {
        disk.remove_folder(folder).map_err(|error| Error::io(folder, "replace", error))?;
    }
    disk.rename(unfinished, folder).map_err(|error| Error::io(unfinished, "rename", error))
}

fn sync_paths(disk: &dyn Disk, files: &[PathBuf], folders: &[PathBuf]) -> Result<()> {
    let [of_files, of_folders] = disk.sync_all(files, folders);
    let paths = files.iter().chain(folders);
    paths
        .zip(of_files.into_iter().chain(of_folders))
        .try_for_each(|(path, synced)| synced.map_err(|error| Error::io(path, "sync", error)))
}
