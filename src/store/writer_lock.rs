use super::disk::{Disk, DiskLock};
use super::layout::Layout;
use crate::error::{Error, Result};
use std::path::PathBuf;

/// Held while a store may write; a process that ends, however it ends, lets go of it.
pub struct WriterLock {
    lock: Box<dyn DiskLock>,
    path: PathBuf,
}

impl WriterLock {
    /// Takes the lock of a map.
    ///
    /// # Errors
    ///
    /// [`Error::Locked`] if another process has it.
    pub fn take(disk: &dyn Disk, layout: &Layout) -> Result<Self> {
        let path = layout.lock();
        match disk.lock(&path).map_err(|error| Error::io(&path, "lock", error))? {
            Some(lock) => Ok(Self { lock, path }),
            None => Err(Error::Locked { path: layout.folder().to_owned() }),
        }
    }

    /// Looks whether the lock still keeps others out. It does not once somebody has removed its file.
    ///
    /// # Errors
    ///
    /// [`Error::LockLost`] if it does not; a disk that refuses.
    pub fn check(&self) -> Result<()> {
        match self.lock.is_in_place().map_err(|error| Error::io(&self.path, "look at", error))? {
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
