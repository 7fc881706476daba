use crate::error::{Error, Result, is_of_medium};
use crate::store::disk::{Disk, EntryKind};
use crate::store::layout::Layout;
use std::io;
use std::path::{Path, PathBuf};

/// Folder in a map for files that repair removes from it. Nothing is deleted.
#[derive(Debug)]
pub struct Quarantine<'a> {
    disk: &'a dyn Disk,
    layout: &'a Layout,
}

impl<'a> Quarantine<'a> {
    /// Returns the quarantine of a map.
    pub fn new(disk: &'a dyn Disk, layout: &'a Layout) -> Self {
        Self { disk, layout }
    }

    /// Moves a file or folder of the map to quarantine. Returns the new path.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn take(&self, path: &Path) -> Result<PathBuf> {
        let to = self.place_for(path)?;
        self.disk.rename(path, &to).map_err(|error| Error::io(path, "move to quarantine", error))?;
        self.sync(&self.layout.quarantine())?;
        if let Some(folder) = path.parent() {
            self.sync(folder)?;
        }
        Ok(to)
    }

    /// Copies a file that is about to be replaced to quarantine. Returns the path of the copy, or `None` if there is no
    /// file. Anything that is not a regular file, or cannot be read, is moved.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn take_copy(&self, path: &Path) -> Result<Option<PathBuf>> {
        match self.copy(path) {
            Err(error) if is_of_file(&error) => self.take(path).map(Some),
            copied => copied,
        }
    }

    /// Copies a file to quarantine that is still needed in place. A file that cannot be read gets a hard link in
    /// quarantine instead. Returns the new path. Returns `None` if there is no file, or if neither is possible: then
    /// the caller must move it later.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn keep(&self, path: &Path) -> Result<Option<PathBuf>> {
        match self.copy(path) {
            Err(error) if is_of_file(&error) => self.link(path),
            copied => copied,
        }
    }

    /// Adds a hard link to a file in quarantine. Returns its path, or `None` if the file system has no hard links.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn link(&self, path: &Path) -> Result<Option<PathBuf>> {
        let to = self.place_for(path)?;
        if self.disk.link(path, &to).is_err() {
            return Ok(None);
        }
        self.sync(&self.layout.quarantine())?;
        Ok(Some(to))
    }

    /// Copies a file to quarantine. Returns the path of the copy, or `None` if there is no file.
    ///
    /// # Errors
    ///
    /// An I/O error, including a file that cannot be read.
    pub fn copy(&self, path: &Path) -> Result<Option<PathBuf>> {
        let mut input = match self.disk.open(path) {
            Ok(input) => input,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(Error::io(path, "open", error)),
        };
        let to = self.place_for(path)?;
        let mut copied = || {
            let mut out = self.disk.create(&to)?;
            io::copy(&mut input, &mut out)?;
            out.sync()
        };
        if let Err(error) = copied() {
            let _ = self.disk.remove_file(&to);
            return Err(Error::io(path, "copy to quarantine", error));
        }
        self.sync(&self.layout.quarantine())?;
        Ok(Some(to))
    }

    fn place_for(&self, path: &Path) -> Result<PathBuf> {
        let folder = self.layout.quarantine();
        if self.kind(&folder)?.is_none() {
            self.disk.create_folder(&folder).map_err(|error| Error::io(&folder, "create", error))?;
            self.sync(self.layout.folder())?;
        }
        // The name of a file from a tile's folder is prefixed with the name of that folder.
        let inside = path.strip_prefix(self.layout.folder()).unwrap_or(path);
        let parts: Vec<_> = inside.iter().map(|part| part.to_string_lossy()).collect();
        let name = parts.join(".");
        let mut to = folder.join(&name);
        for number in 1.. {
            if self.kind(&to)?.is_none() {
                break;
            }
            to = folder.join(format!("{name}.{number}"));
        }
        Ok(to)
    }

    fn kind(&self, path: &Path) -> Result<Option<EntryKind>> {
        self.disk.kind_at(path)
    }

    fn sync(&self, folder: &Path) -> Result<()> {
        self.disk.sync_folder(folder).map_err(|error| Error::io(folder, "sync", error))
    }
}

/// Returns whether an error is specific to one file: it is unreadable or not a regular file.
fn is_of_file(error: &Error) -> bool {
    matches!(error, Error::Io { cause, .. } if is_of_medium(cause) || cause.kind() == io::ErrorKind::InvalidInput)
}
