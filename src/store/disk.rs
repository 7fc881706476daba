use crate::error::{Error, Result};
use crate::scratch::Scratch;
use std::fmt::Debug;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

/// Interface to the file system, with one method for each operation on a map's files.
///
/// [`FsDisk`](super::FsDisk) implements it with the operating system. Tests use disks that fail, fill up or crash.
pub trait Disk: Debug + Send + Sync {
    /// Opens a regular file for reading. Other kinds of files, including symbolic links, are an error of kind
    /// `InvalidInput`. Content that is lost or damaged is an error of kind `InvalidData`, here or while it is read.
    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskRead>>;
    /// Opens a file for reading, starting at `offset`.
    fn open_at(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskRead>> {
        let mut input = self.open(path)?;
        io::copy(&mut input.by_ref().take(offset), &mut io::sink())?;
        Ok(input)
    }
    /// Reads up to `bytes` bytes at `offset`, fewer at the end of the file.
    fn read_at(&self, path: &Path, offset: u64, bytes: usize) -> io::Result<Vec<u8>> {
        let mut read = Vec::new();
        self.open_at(path, offset)?.take(bytes as u64).read_to_end(&mut read)?;
        Ok(read)
    }
    /// Opens a file for reading and registers as its reader until the result is dropped, see [`Disk::watch`]. On a file
    /// system without locks the file is opened, but its reader cannot be detected.
    fn open_shared(&self, path: &Path) -> io::Result<Box<dyn DiskRead>>;
    /// Watches for readers of the file that has this name now, even after another file replaces it.
    fn watch(&self, path: &Path) -> io::Result<Box<dyn ReaderWatch>>;
    /// Creates or truncates a file for writing. If the file has other hard links ([`Disk::link`]), their content is
    /// unchanged.
    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskWrite>>;
    /// Opens an existing file of at least `offset` bytes, truncates it to `offset`, and appends from there.
    fn append(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskWrite>>;
    /// Makes a file's content durable.
    fn sync_file(&self, path: &Path) -> io::Result<()>;
    /// Makes the entries of a folder durable.
    fn sync_folder(&self, path: &Path) -> io::Result<()>;
    /// Makes the content of files and then the entries of folders durable, each in any order. Returns the results of
    /// the files and of the folders.
    fn sync_all(&self, files: &[PathBuf], folders: &[PathBuf]) -> [Vec<io::Result<()>>; 2] {
        [
            files.iter().map(|path| self.sync_file(path)).collect(),
            folders.iter().map(|path| self.sync_folder(path)).collect(),
        ]
    }
    /// Renames a file, replacing an existing file, or renames a folder to an unused name.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;
    /// Swaps the names of two folders atomically. Fails where the file system does not support that.
    fn exchange(&self, _: &Path, _: &Path) -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
    }
    /// Creates a hard link to a file, with an unused name. Fails where the file system has no hard links.
    fn link(&self, _: &Path, _: &Path) -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
    }
    /// Removes a file.
    fn remove_file(&self, path: &Path) -> io::Result<()>;
    /// Creates a folder. Its parent must exist.
    fn create_folder(&self, path: &Path) -> io::Result<()>;
    /// Removes an empty folder.
    fn remove_folder(&self, path: &Path) -> io::Result<()>;
    /// Lists the names in a folder, in no particular order. Names that are not UTF-8 are omitted.
    fn list(&self, path: &Path) -> io::Result<Vec<String>>;
    /// Creates an unnamed file on the file system of `folder`. It is deleted when it is dropped.
    fn scratch(&self, folder: &Path) -> io::Result<Box<dyn Scratch>>;
    /// Returns the kind of a directory entry without following links; `None` if the name does not exist.
    fn kind(&self, path: &Path) -> io::Result<Option<EntryKind>>;
    /// Returns `path` as an absolute path, with links resolved in the part that exists.
    fn resolve(&self, path: &Path) -> io::Result<PathBuf> {
        Ok(path.to_owned())
    }
    /// Locks a file, which is created if missing, until the returned value is dropped. Returns `None` if the lock is
    /// held elsewhere. Requires write permission for the file.
    fn lock(&self, path: &Path) -> io::Result<Option<Box<dyn DiskLock>>>;
    /// Returns the current state if this disk is a view of a past state and the content has changed since; otherwise
    /// `None`. Most disks always show the current state.
    fn newer(&self) -> io::Result<Option<Arc<dyn Disk>>> {
        Ok(None)
    }
    /// Maximum number of files to announce by [`Disk::read_ahead`] at a time; 0 if read-ahead does not help.
    fn files_ahead(&self) -> usize {
        0
    }
    /// Announces that a file will be opened soon. Errors are reported when the file is opened.
    fn read_ahead(&self, _: &Path) {}
    /// Waits briefly for another process.
    fn pause(&self) {
        thread::sleep(Duration::from_millis(2));
    }
}

impl dyn Disk + '_ {
    /// Like [`Disk::kind`], with an error that names the path.
    pub fn kind_at(&self, path: &Path) -> Result<Option<EntryKind>> {
        self.kind(path).map_err(|error| Error::io(path, "access", error))
    }
}

/// Kind of a directory entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EntryKind {
    /// A regular file with its length in bytes.
    File(u64),
    /// A folder.
    Folder,
    /// A symbolic link or another kind of entry that a map does not contain.
    Other,
}

/// A file open for reading.
pub trait DiskRead: Read + Send {
    /// Length of the file in bytes when it was opened.
    fn file_bytes(&self) -> u64;
}

/// Detects readers of a file.
pub trait ReaderWatch: Send + Sync {
    /// Returns whether a process holds the file open by [`Disk::open_shared`].
    fn has_readers(&self) -> bool;
}

/// A lock that is held until it is dropped.
pub trait DiskLock: Send + Sync {
    /// Returns whether the locked file still has its name. If not, another process can lock the file that has the name
    /// now.
    fn is_in_place(&self) -> io::Result<bool>;
}

/// A file open for writing.
pub trait DiskWrite: Write + Send {
    /// Makes the written bytes durable.
    fn sync(&mut self) -> io::Result<()>;
}
