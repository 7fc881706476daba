use super::disk::{Disk, EntryKind};
use super::layout::Layout;
use crate::error::{Error, Result};
use std::io;
use std::path::Path;
use std::sync::Arc;

/// Layout of a map and operations on its files. Errors name the path.
#[derive(Clone, Debug)]
pub(super) struct MapFiles {
    disk: Arc<dyn Disk>,
    layout: Layout,
}

impl MapFiles {
    pub(super) fn new(disk: Arc<dyn Disk>, layout: Layout) -> Self {
        Self { disk, layout }
    }

    pub(super) fn disk(&self) -> &Arc<dyn Disk> {
        &self.disk
    }

    pub(super) fn layout(&self) -> &Layout {
        &self.layout
    }

    pub(super) fn folder(&self) -> &Path {
        self.layout.folder()
    }

    /// Renames a file. A missing file is ignored: an earlier attempt may have renamed it.
    pub(super) fn rename(&self, from: &Path, to: &Path) -> Result<()> {
        match self.disk.rename(from, to) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            result => result.map_err(|error| Error::io(from, "rename", error)),
        }
    }

    pub(super) fn remove_file(&self, path: &Path) -> Result<()> {
        match self.disk.remove_file(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            result => result.map_err(|error| Error::io(path, "remove", error)),
        }
    }

    pub(super) fn kind(&self, path: &Path) -> Result<Option<EntryKind>> {
        self.disk.kind_at(path)
    }

    pub(super) fn sync_folder(&self, folder: &Path) -> Result<()> {
        self.disk.sync_folder(folder).map_err(|error| Error::io(folder, "sync", error))
    }

    pub(super) fn sync_map_folder(&self) -> Result<()> {
        self.sync_folder(self.folder())
    }
}
