use crate::error::{Error, Result};
use crate::scratch::Scratch;
use std::fmt::Debug;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

/// The interface to the file system: every operation on a map's files, one method each.
///
/// [`FsDisk`](super::FsDisk) is the real one; tests put in disks that fail, fill up or crash.
pub trait Disk: Debug + Send + Sync {
    /// Opens a file for reading. Anything else, a symbolic link too, is an error of the kind `InvalidInput`.
    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskRead>>;
    /// Opens a file for reading from `offset` on.
    fn open_at(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskRead>> {
        let mut input = self.open(path)?;
        io::copy(&mut input.by_ref().take(offset), &mut io::sink())?;
        Ok(input)
    }
    /// Reads some bytes of a file, fewer if it ends before.
    fn read_at(&self, path: &Path, offset: u64, bytes: usize) -> io::Result<Vec<u8>> {
        let mut read = Vec::new();
        self.open_at(path, offset)?.take(bytes as u64).read_to_end(&mut read)?;
        Ok(read)
    }
    /// Opens a file for reading and counts as its reader until the result is dropped: [`Disk::watch`] tells. Where
    /// the file system has no locks, the file is opened and nobody can tell.
    fn open_shared(&self, path: &Path) -> io::Result<Box<dyn DiskRead>>;
    /// Watches for readers of the file that has the name now, even after another file took its name.
    fn watch(&self, path: &Path) -> io::Result<Box<dyn ReaderWatch>>;
    /// Creates a file, or empties it, for writing from the beginning. A file with other names too ([`Disk::link`])
    /// keeps its content under those.
    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskWrite>>;
    /// Opens a file, which must be there and be that long, for writing from `offset` on; what stood there is cut off.
    fn append(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskWrite>>;
    /// Makes a file's content durable.
    fn sync_file(&self, path: &Path) -> io::Result<()>;
    /// Makes the names in a folder durable.
    fn sync_folder(&self, path: &Path) -> io::Result<()>;
    /// Makes the content of many files and then the names in many folders durable, in any order among the files and
    /// among the folders. Answers with the results for the files and for the folders.
    fn sync_all(&self, files: &[PathBuf], folders: &[PathBuf]) -> [Vec<io::Result<()>>; 2] {
        [
            files.iter().map(|path| self.sync_file(path)).collect(),
            folders.iter().map(|path| self.sync_folder(path)).collect(),
        ]
    }
    /// Renames a file, replacing what had the new name, or a folder to a name that nothing has.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;
    /// Gives each of two folders the name of the other, at once. An error where that cannot be done at once.
    fn exchange(&self, _: &Path, _: &Path) -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
    }
    /// Gives a file another name, which nothing has; the two are one file. An error where files have one name only.
    fn link(&self, _: &Path, _: &Path) -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
    }
    /// Removes a file.
    fn remove_file(&self, path: &Path) -> io::Result<()>;
    /// Makes a folder; its parents must exist.
    fn create_folder(&self, path: &Path) -> io::Result<()>;
    /// Removes an empty folder.
    fn remove_folder(&self, path: &Path) -> io::Result<()>;
    /// The names in a folder, in no particular order; names that are not UTF-8 are left out.
    fn list(&self, path: &Path) -> io::Result<Vec<String>>;
    /// A file without a name on the same file system as a folder, which goes when it is dropped.
    fn scratch(&self, folder: &Path) -> io::Result<Box<dyn Scratch>>;
    /// What has a name, links not followed; `None` if nothing has.
    fn kind(&self, path: &Path) -> io::Result<Option<EntryKind>>;
    /// The same place as an absolute path without links, as far as it is there.
    fn resolve(&self, path: &Path) -> io::Result<PathBuf> {
        Ok(path.to_owned())
    }
    /// Locks a file, made if missing, until the returned value is dropped; `None` if another holds it. Only who may
    /// write the file can lock it.
    fn lock(&self, path: &Path) -> io::Result<Option<Box<dyn DiskLock>>>;
    /// The present state of what this disk shows as of a moment; `None` if it has not changed, or if this disk shows
    /// what is there at any moment, as most do.
    fn newer(&self) -> io::Result<Option<Arc<dyn Disk>>> {
        Ok(None)
    }
    /// How many files are worth naming by [`Disk::read_ahead`]: none where reading takes no longer than asking.
    fn files_ahead(&self) -> usize {
        0
    }
    /// Says that a file will be opened soon. What goes wrong is told when it is.
    fn read_ahead(&self, _: &Path) {}
    /// Waits a moment for another process.
    fn pause(&self) {
        thread::sleep(Duration::from_millis(2));
    }
}

impl dyn Disk + '_ {
    /// [`Disk::kind`], whose error names the path.
    pub fn kind_at(&self, path: &Path) -> Result<Option<EntryKind>> {
        self.kind(path).map_err(|error| Error::io(path, "look at", error))
    }
}

/// What a name in a folder stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EntryKind {
    /// A file of so many bytes.
    File(u64),
    /// A folder.
    Folder,
    /// A symbolic link or something else that a map does not contain.
    Other,
}

/// A file open for reading.
pub trait DiskRead: Read + Send {
    /// Length of the file in bytes when it was opened.
    fn file_bytes(&self) -> u64;
}

/// Tells whether a file has readers.
pub trait ReaderWatch: Send + Sync {
    /// Whether some process holds the file open by [`Disk::open_shared`].
    fn has_readers(&self) -> bool;
}

/// A lock that is held until it is dropped.
pub trait DiskLock: Send + Sync {
    /// Whether the locked file still has its name. If it has not, another process can lock the one that has.
    fn is_in_place(&self) -> io::Result<bool>;
}

/// A file open for writing.
pub trait DiskWrite: Write + Send {
    /// Makes what was written durable.
    fn sync(&mut self) -> io::Result<()>;
}
