use super::staged_map::{remove_content, remove_unfinished};
use crate::error::{Error, Result};
use crate::store::disk::Disk;
use crate::store::layout::Layout;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A folder beside a map for a second map, out of which the first takes tiles over: `MAP.remapping`. Nobody needs it
/// afterwards: it goes when this value is dropped, or with the next attempt.
#[derive(Debug)]
pub struct SideFolder {
    disk: Arc<dyn Disk>,
    path: PathBuf,
}

impl SideFolder {
    /// Makes room for a map beside `map`; [`TileStore::create`](crate::store::TileStore::create) makes the folder.
    ///
    /// # Errors
    ///
    /// A path without a name; something that is not of a map in its place; another process that is at work there; a
    /// disk that refuses.
    pub fn begin(disk: Arc<dyn Disk>, map: &Path) -> Result<Self> {
        if map.file_name().is_none() {
            let reason = format!("{} has no name of its own; name the map's folder", map.display());
            return Err(Error::argument("map", reason));
        }
        let path = map.with_added_extension("remapping");
        remove_unfinished(&*disk, &path)?;
        Ok(Self { disk, path })
    }

    /// Where the second map is.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for SideFolder {
    fn drop(&mut self) {
        // What stays after all is removed by the next attempt.
        let _ = remove_content(&*self.disk, &Layout::new(&self.path), true);
        let _ = self.disk.remove_folder(&self.path);
    }
}
