use super::commit_log::Commits;
use super::disk::Disk;
use super::layout::{Layout, TileFile, tile_of_folder};
use super::tile_stamp::{FileStamp, Stamping};
use crate::error::{Error, Result};
use crate::space::TileIndex;
use rustc_hash::FxHashSet;
use std::io;
use std::path::Path;

/// Brings the files to the state of the last commit: finishes its renames, removes every other `*.next`. Returns
/// the tile folders that hold files and are not in the log.
///
/// Safe to repeat and to break off anywhere.
pub(super) fn recover(disk: &dyn Disk, layout: &Layout, commits: &Commits) -> Result<FxHashSet<TileIndex>> {
    let names = disk.list(layout.folder()).map_err(|error| Error::io(layout.folder(), "list", error))?;
    let changed: FxHashSet<TileIndex> = commits.last_changed.iter().copied().collect();
    let mut strays = FxHashSet::default();
    for name in names {
        let path = layout.folder().join(&name);
        if name.ends_with(".next") {
            disk.remove_file(&path).map_err(|error| Error::io(&path, "remove", error))?;
        }
        let Some(tile) = tile_of_folder(&name) else { continue };
        recover_tile(disk, layout, commits, tile, changed.contains(&tile))?;
        if !commits.tiles.contains_key(&tile) {
            let names = disk.list(&path).map_err(|error| Error::io(&path, "list", error))?;
            if names.is_empty() {
                // Made for a tile that was never committed.
                disk.remove_folder(&path).map_err(|error| Error::io(&path, "remove", error))?;
            } else {
                strays.insert(tile);
            }
        }
    }
    Ok(strays)
}

fn recover_tile(
    disk: &dyn Disk,
    layout: &Layout,
    commits: &Commits,
    tile: TileIndex,
    is_of_last_commit: bool,
) -> Result<()> {
    let mut renamed = false;
    for file in TileFile::IN_ORDER {
        let next = layout.next(tile, file);
        if disk.kind(&next).map_err(|error| Error::io(&next, "look at", error))?.is_none() {
            continue;
        }
        let current = layout.current(tile, file);
        if is_of_last_commit {
            let committed = commits.tiles[&tile].of(file);
            if stamp_of(disk, &next)? == Some(committed) {
                disk.rename(&next, &current).map_err(|error| Error::io(&next, "rename", error))?;
                renamed = true;
                continue;
            }
            if stamp_of(disk, &current)? != Some(committed) {
                // Neither is what was committed: damage, which is reported when the tile is read. Keep both.
                continue;
            }
        }
        disk.remove_file(&next).map_err(|error| Error::io(&next, "remove", error))?;
    }
    if renamed {
        let folder = layout.tile_folder(tile);
        disk.sync_folder(&folder).map_err(|error| Error::io(&folder, "sync", error))?;
    }
    Ok(())
}

/// Length and checksum of a file; `None` if there is none.
pub(super) fn stamp_of(disk: &dyn Disk, path: &Path) -> Result<Option<FileStamp>> {
    let input = match disk.open(path) {
        Ok(input) => input,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(Error::io(path, "open", error)),
    };
    let mut input = Stamping::new(input);
    io::copy(&mut input, &mut io::sink()).map_err(|error| Error::io(path, "read", error))?;
    Ok(Some(input.finish().0))
}
