use super::disk::Disk;
use super::fs_disk::FsDisk;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where a map is: a folder of the file system, which is made of any path, or of another [`Disk`].
///
/// ```
/// use voxtile::MapPath;
///
/// let city: MapPath = "maps/city".into();
/// assert_eq!(city.folder(), "maps/city");
/// ```
#[derive(Clone, Debug)]
pub struct MapPath {
    disk: Arc<dyn Disk>,
    folder: PathBuf,
}

impl<P: AsRef<Path>> From<P> for MapPath {
    fn from(folder: P) -> Self {
        Self::on(Arc::new(FsDisk), folder)
    }
}

impl MapPath {
    /// A folder of another disk than the file system.
    pub fn on(disk: Arc<dyn Disk>, folder: impl AsRef<Path>) -> Self {
        Self { disk, folder: folder.as_ref().to_owned() }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The disk and the folder.
    pub fn into_parts(self) -> (Arc<dyn Disk>, PathBuf) {
        (self.disk, self.folder)
    }
}
