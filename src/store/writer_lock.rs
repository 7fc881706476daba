use super::disk::{Disk, DiskLock};
use super::layout::Layout;
use crate::error::{Error, Result};
use std::path::PathBuf;

/// Lock on a map for writing, held until it is dropped. The operating system releases it when the process ends.
pub struct WriterLock {
    lock: Box<dyn DiskLock>,
    path: PathBuf,
}

impl WriterLock {
    /// Takes the writer lock of a map.
    ///
    /// # Errors
    ///
    /// [`Error::Locked`] if another process holds the lock.
    pub fn take(disk: &dyn Disk, layout: &Layout) -> Result<Self> {
        let path = layout.lock();
        match disk.lock(&path).map_err(|error| Error::io(&path, "lock", error))? {
            Some(lock) => Ok(Self { lock, path }),
            None => Err(Error::Locked { path: layout.folder().to_owned() }),
        }
    }

    /// Checks that the lock is still effective. It is lost if another program has removed the lock file.
    ///
    /// # Errors
    ///
    /// [`Error::LockLost`] if the lock file was removed, or an I/O error.
    pub fn check(&self) -> Result<()> {
        match self.lock.is_in_place().map_err(|error| Error::io(&self.path, "access", error))? {
            true => Ok(()),
            false => Err(Error::LockLost { path: self.path.clone() }),
        }
    }
}

impl std::fmt::Debug for WriterLock {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("WriterLock")
    }
}
