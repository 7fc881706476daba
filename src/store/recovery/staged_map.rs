use crate::error::{Error, Result};
use crate::store::WriterLock;
use crate::store::commit::metadata::Metadata;
use crate::store::disk::{Disk, EntryKind};
use crate::store::layout::{Layout, tile_of_folder};
use crate::store::map_folder;
use crate::store::path_check;
use crate::store::tile_store::TileStore;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// New map in `MAP.unfinished`, next to its final path. [`StagedMap::finish`] renames it. The rename is the commit, so
/// an incomplete map is never visible.
///
/// If this value is dropped before [`StagedMap::finish`], the folder is removed. The next attempt removes the remains
/// of a killed one.
#[derive(Debug)]
pub struct StagedMap<W = TileStore> {
    disk: Arc<dyn Disk>,
    folder: PathBuf,
    /// Writer of the map, which holds the lock of the unfinished folder. `None` after the rename.
    writer: Option<W>,
}

impl StagedMap {
    /// Begins a map that will be in `folder`, which must be missing or empty.
    ///
    /// # Errors
    ///
    /// A folder with other content, another process that creates the same map, or an I/O error.
    pub fn begin(disk: Arc<dyn Disk>, folder: &Path, metadata: Metadata, map_id: [u8; 16]) -> Result<Self> {
        let create = |unfinished: &Path| TileStore::create(disk.clone(), unfinished, metadata, map_id);
        Self::begin_by(disk.clone(), folder, create)
    }

    /// Tiles of the map, to be written. Only committed tiles become part of the map.
    pub fn store(&mut self) -> &mut TileStore {
        self.writer()
    }
}

impl<W> StagedMap<W> {
    /// Begins a map that will be in `folder`, which must be missing or empty. `create` creates it at the path in its
    /// argument, and must hold the lock of that folder.
    ///
    /// # Errors
    ///
    /// As for [`StagedMap::begin`], and those of `create`.
    pub fn begin_by(
        disk: Arc<dyn Disk>,
        folder: &Path,
        create: impl FnOnce(&Path) -> Result<W>,
    ) -> Result<Self> {
        path_check::check_path(&*disk, folder)?;
        check_is_free(&*disk, folder)?;
        let unfinished = staging_folder(folder)?;
        remove_unfinished(&*disk, &unfinished)?;
        let writer = create(&unfinished).inspect_err(|_| {
            // Remove the incomplete map, unless another process uses it now.
            if remove_unfinished(&*disk, &unfinished).is_ok() {
                let _ = disk.remove_file(&Layout::new(&unfinished).lock());
                let _ = disk.remove_folder(&unfinished);
            }
        })?;
        Ok(Self { disk, folder: folder.to_owned(), writer: Some(writer) })
    }

    /// Final path of the map.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Writer of the map, for reading.
    pub fn get(&self) -> &W {
        self.writer.as_ref().expect("only `finish` takes the writer, and it consumes the map")
    }

    /// Writer of the map.
    pub fn writer(&mut self) -> &mut W {
        self.writer.as_mut().expect("only `finish` takes the writer, and it consumes the map")
    }

    /// Renames the map to its final path. All commits are visible from then on, and durable when this returns.
    ///
    /// # Errors
    ///
    /// An existing file or folder with that name, or an I/O error. After an error of the last step, the sync of the
    /// parent folder, the map has its final name.
    pub fn finish(mut self) -> Result<()> {
        check_is_free(&*self.disk, &self.folder)?;
        let unfinished = staging_folder(&self.folder)?;
        let is_there = self.disk.kind_at(&self.folder)?;
        if is_there.is_some() {
            self.disk
                .remove_folder(&self.folder)
                .map_err(|error| Error::io(&self.folder, "replace", error))?;
        }
        if cfg!(windows) {
            // Windows cannot rename a folder with an open file. Elsewhere the lock is held until the rename.
            self.writer = None;
        }
        if let Err(error) = self.disk.rename(&unfinished, &self.folder) {
            return Err(Error::io(&unfinished, "rename", error));
        }
        self.writer = None;
        let parent = map_folder::parent_of(&self.folder);
        self.disk.sync_folder(parent).map_err(|error| Error::io(parent, "sync", error))
    }
}

impl<W> Drop for StagedMap<W> {
    fn drop(&mut self) {
        if let (Some(_lock), Ok(unfinished)) = (&self.writer, staging_folder(&self.folder)) {
            // The next attempt removes whatever remains.
            let _ = remove_content(&*self.disk, &Layout::new(&unfinished), true);
            let _ = self.disk.remove_folder(&unfinished);
        }
    }
}

/// Returns the path at which a map for `folder` is created.
///
/// # Errors
///
/// A path without a name, such as `..`.
pub fn staging_folder(folder: &Path) -> Result<PathBuf> {
    match folder.file_name() {
        Some(_) => Ok(folder.with_added_extension("unfinished")),
        None => {
            let reason = format!(
                "{} does not end with a folder name; give the path of a new folder",
                folder.display()
            );
            Err(Error::argument("output", reason))
        }
    }
}

pub(super) fn check_is_free(disk: &dyn Disk, folder: &Path) -> Result<()> {
    let is_free = match disk.kind_at(folder)? {
        None => true,
        Some(EntryKind::Folder) => {
            disk.list(folder).map_err(|error| Error::io(folder, "list", error))?.is_empty()
        }
        Some(_) => false,
    };
    if is_free {
        return Ok(());
    }
    let hint = "choose a folder that does not exist yet, or remove this one first";
    Err(Error::AlreadyExists { path: folder.to_owned(), hint })
}

/// Removes the remains of an interrupted attempt. Foreign content is kept and is an error.
pub(super) fn remove_unfinished(disk: &dyn Disk, folder: &Path) -> Result<()> {
    match disk.kind_at(folder)? {
        None => return Ok(()),
        Some(EntryKind::Folder) => {}
        Some(_) => return Err(not_of_a_map(folder)),
    }
    let layout = Layout::new(folder);
    // Check the content before the lock is taken, because locking creates a file.
    check_content(disk, &layout)?;
    let _lock = WriterLock::take(disk, &layout)?;
    remove_content(disk, &layout, false)
}

/// Files outside tile folders that a map can have while it is created.
const OWN_FILES: [&str; 6] =
    ["metadata.json", "metadata.json.next", "commits.log", "commits.log.next", "scans.bin", "writer.lock"];

fn check_content(disk: &dyn Disk, layout: &Layout) -> Result<()> {
    for name in list(disk, layout.folder())? {
        let path = layout.folder().join(&name);
        if path == layout.kept_scans() {
            check_kept_scans(disk, layout)?;
        } else if !OWN_FILES.contains(&&*name) && tile_of_folder(&name).is_none() {
            return Err(not_of_a_map(&path));
        }
    }
    Ok(())
}

fn check_kept_scans(disk: &dyn Disk, layout: &Layout) -> Result<()> {
    let folder = layout.kept_scans();
    if disk.kind_at(&folder)? != Some(EntryKind::Folder) {
        return Err(not_of_a_map(&folder));
    }
    match list(disk, &folder)?.into_iter().find(|name| !Layout::is_of_kept_scans(name)) {
        Some(name) => Err(not_of_a_map(&folder.join(name))),
        None => Ok(()),
    }
}

/// Removes the files of a map and its tile folders, `metadata.json` and `commits.log` first.
pub(super) fn remove_content(disk: &dyn Disk, layout: &Layout, with_lock: bool) -> Result<()> {
    check_content(disk, layout)?;
    let remove = |path: &Path| match disk.remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Error::io(path, "remove", error)),
        _ => Ok(()),
    };
    for name in OWN_FILES.iter().filter(|&&name| name != "writer.lock") {
        remove(&layout.folder().join(name))?;
    }
    let names = list(disk, layout.folder())?;
    let kept_scans = Some(layout.kept_scans()).filter(|kept| names.iter().any(|name| kept.ends_with(name)));
    let tiles = names.iter().filter_map(|name| tile_of_folder(name)).map(|tile| layout.tile_folder(tile));
    for folder in tiles.chain(kept_scans) {
        if disk.kind_at(&folder)? != Some(EntryKind::Folder) {
            // A symbolic link could lead out of the map.
            return Err(not_of_a_map(&folder));
        }
        for name in list(disk, &folder)? {
            remove(&folder.join(name))?;
        }
        disk.remove_folder(&folder).map_err(|error| Error::io(&folder, "remove", error))?;
    }
    if with_lock { remove(&layout.lock()) } else { Ok(()) }
}

fn not_of_a_map(path: &Path) -> Error {
    let hint = "this path is needed for a temporary map; move or remove the existing content";
    Error::AlreadyExists { path: path.to_owned(), hint }
}

fn list(disk: &dyn Disk, folder: &Path) -> Result<Vec<String>> {
    disk.list(folder).map_err(|error| Error::io(folder, "list", error))
}
