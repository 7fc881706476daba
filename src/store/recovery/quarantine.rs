use crate::error::{Error, Result, is_of_medium};
use crate::store::disk::{Disk, EntryKind};
use crate::store::layout::Layout;
use std::io;
use std::path::{Path, PathBuf};

/// The folder in a map that takes what repair takes out: nothing is deleted.
#[derive(Debug)]
pub struct Quarantine<'a> {
    disk: &'a dyn Disk,
    layout: &'a Layout,
}

impl<'a> Quarantine<'a> {
    /// The quarantine of a map.
    pub fn new(disk: &'a dyn Disk, layout: &'a Layout) -> Self {
        Self { disk, layout }
    }

    /// Moves a file or folder of the map; returns where to.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn take(&self, path: &Path) -> Result<PathBuf> {
        let to = self.place_for(path)?;
        self.disk.rename(path, &to).map_err(|error| Error::io(path, "move to quarantine", error))?;
        self.sync(&self.layout.quarantine())?;
        if let Some(folder) = path.parent() {
            self.sync(folder)?;
        }
        Ok(to)
    }

    /// Copies a file that is about to be replaced; returns where to, `None` if there is no file. What is none, or
    /// cannot be read, is moved as it is.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn take_copy(&self, path: &Path) -> Result<Option<PathBuf>> {
        match self.copy(path) {
            Err(error) if is_of_file(&error) => self.take(path).map(Some),
            copied => copied,
        }
    }

    /// Copies a file whose readable rest is still needed where it is; one that cannot be read gets another name here,
    /// too. Returns where to; `None` if there is no file, or neither can be done: then it is to be taken once it is no
    /// longer needed.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn keep(&self, path: &Path) -> Result<Option<PathBuf>> {
        match self.copy(path) {
            Err(error) if is_of_file(&error) => self.link(path),
            copied => copied,
        }
    }

    /// Gives a file another name here; returns which. `None` where a file has one name only.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    pub fn link(&self, path: &Path) -> Result<Option<PathBuf>> {
        let to = self.place_for(path)?;
        if self.disk.link(path, &to).is_err() {
            return Ok(None);
        }
        self.sync(&self.layout.quarantine())?;
        Ok(Some(to))
    }

    /// Copies a file; returns where to, `None` if there is no file.
    ///
    /// # Errors
    ///
    /// A disk that refuses, among other things to give the file back.
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

    /// A name in quarantine that nothing has.
    fn place_for(&self, path: &Path) -> Result<PathBuf> {
        let folder = self.layout.quarantine();
        if self.kind(&folder)?.is_none() {
            self.disk.create_folder(&folder).map_err(|error| Error::io(&folder, "create", error))?;
            self.sync(self.layout.folder())?;
        }
        // What was in a tile's folder keeps that folder's name before its own.
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

/// Whether an error is about a file by itself: it cannot be read, or is none.
fn is_of_file(error: &Error) -> bool {
    matches!(error, Error::Io { cause, .. } if is_of_medium(cause) || cause.kind() == io::ErrorKind::InvalidInput)
}
