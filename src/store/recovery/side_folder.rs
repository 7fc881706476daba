use super::staged_map::{remove_content, remove_unfinished};
use crate::error::{Error, Result};
use crate::store::disk::Disk;
use crate::store::layout::Layout;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Folder `MAP.remapping` next to a map, for a temporary second map whose tiles are moved into the first. It is removed
/// when this value is dropped, or by the next attempt.
#[derive(Debug)]
pub struct SideFolder {
    disk: Arc<dyn Disk>,
    path: PathBuf,
}

impl SideFolder {
    /// Prepares the path next to `map`. [`TileStore::create`](crate::store::TileStore::create) creates the folder.
    ///
    /// # Errors
    ///
    /// A path without a name, foreign content in the folder, another process that uses it, or an I/O error.
    pub fn begin(disk: Arc<dyn Disk>, map: &Path) -> Result<Self> {
        if map.file_name().is_none() {
            let reason = format!(
                "{} does not end with a folder name; give the map's path with its name",
                map.display()
            );
            return Err(Error::argument("map", reason));
        }
        let path = map.with_added_extension("remapping");
        remove_unfinished(&*disk, &path)?;
        Ok(Self { disk, path })
    }

    /// Path of the second map.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for SideFolder {
    fn drop(&mut self) {
        // The next attempt removes whatever remains.
        let _ = remove_content(&*self.disk, &Layout::new(&self.path), true);
        let _ = self.disk.remove_folder(&self.path);
    }
}
