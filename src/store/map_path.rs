use super::disk::Disk;
use super::fs_disk::FsDisk;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Location of a map: a folder of the file system or of another [`Disk`]. Any path converts into one.
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
    /// Returns the location of a folder on `disk`.
    pub fn on(disk: Arc<dyn Disk>, folder: impl AsRef<Path>) -> Self {
        Self { disk, folder: folder.as_ref().to_owned() }
    }

    /// The map's folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns the disk and the folder.
    pub fn into_parts(self) -> (Arc<dyn Disk>, PathBuf) {
        (self.disk, self.folder)
    }
}
