use crate::scratch::Scratch;
use std::any::Any;
use std::fmt::Debug;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

/// The one seam to the file system: every operation on a map's files, one method each.
///
/// [`FsDisk`] is the real one; tests put in disks that fail, fill up or crash.
pub trait Disk: Debug + Send + Sync {
    /// Opens a file for reading. Anything else, a symbolic link too, is an error of the kind `InvalidInput`.
    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskRead>>;
    /// Opens a file for reading and counts as its reader until the result is dropped: [`Disk::watch`] tells. Where
    /// the file system has no locks, the file is opened and nobody can tell.
    fn open_shared(&self, path: &Path) -> io::Result<Box<dyn DiskRead>>;
    /// Watches for readers of the file that has the name now, even after another file took its name.
    fn watch(&self, path: &Path) -> io::Result<Box<dyn ReaderWatch>>;
    /// Creates a file, or empties it, for writing from the beginning. A file with other names too ([`Disk::link`]) keeps its
    /// content under those.
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
    fn scratch(&self, folder: &Path) -> io::Result<Box<dyn Scratch>> {
        Ok(Box::new(tempfile::tempfile_in(folder)?))
    }
    /// What has a name, links not followed; `None` if nothing has.
    fn kind(&self, path: &Path) -> io::Result<Option<EntryKind>>;
    /// The same place as an absolute path without links, as far as it is there.
    fn resolve(&self, path: &Path) -> io::Result<PathBuf> {
        Ok(path.to_owned())
    }
    /// Locks a file, made if missing, until the returned value is dropped; `None` if another holds it.
    fn lock(&self, path: &Path) -> io::Result<Option<Box<dyn Any + Send + Sync>>>;
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

/// A file open for writing.
pub trait DiskWrite: Write + Send {
    /// Makes what was written durable.
    fn sync(&mut self) -> io::Result<()>;
}

/// The real file system.
#[derive(Clone, Copy, Debug, Default)]
pub struct FsDisk;

/// How many milliseconds to wait for a lock that a writer holds for an instant.
const LOCK_ATTEMPTS: usize = 100;

struct FsRead {
    file: File,
    bytes: u64,
}

impl Disk for FsDisk {
    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        let file = File::open(only_a_file(path)?)?;
        let bytes = file.metadata()?.len();
        Ok(Box::new(FsRead { file, bytes }))
    }

    fn open_shared(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        let file = File::open(only_a_file(path)?)?;
        // A writer that looks for readers holds the lock for an instant.
        for _ in 0..LOCK_ATTEMPTS {
            match file.try_lock_shared() {
                Err(TryLockError::WouldBlock) => thread::sleep(Duration::from_millis(1)),
                Ok(()) | Err(TryLockError::Error(_)) => break,
            }
        }
        let bytes = file.metadata()?.len();
        Ok(Box::new(FsRead { file, bytes }))
    }

    fn watch(&self, path: &Path) -> io::Result<Box<dyn ReaderWatch>> {
        Ok(Box::new(File::open(only_a_file(path)?)?))
    }

    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskWrite>> {
        if has_other_names(path) {
            fs::remove_file(path)?;
        }
        Ok(Box::new(File::create(only_a_file(path)?)?))
    }

    fn append(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskWrite>> {
        let file = OpenOptions::new().append(true).open(only_a_file(path)?)?;
        let bytes = file.metadata()?.len();
        if bytes < offset {
            let reason = format!("{bytes} bytes, {offset} expected: somebody else changed the file");
            return Err(io::Error::other(reason));
        }
        if bytes > offset {
            file.set_len(offset)?;
        }
        Ok(Box::new(file))
    }

    fn sync_file(&self, path: &Path) -> io::Result<()> {
        OpenOptions::new().write(true).open(only_a_file(path)?)?.sync_all()
    }

    fn sync_folder(&self, path: &Path) -> io::Result<()> {
        // Only Unix lets a folder be opened and synced; elsewhere renames are durable by themselves.
        if cfg!(unix) { File::open(path)?.sync_all() } else { Ok(()) }
    }

    fn sync_all(&self, files: &[PathBuf], folders: &[PathBuf]) -> [Vec<io::Result<()>>; 2] {
        [at_once(files, |path| self.sync_file(path)), at_once(folders, |path| self.sync_folder(path))]
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    fn link(&self, from: &Path, to: &Path) -> io::Result<()> {
        // Elsewhere it cannot be told that a file has other names.
        if cfg!(unix) {
            fs::hard_link(only_a_file(from)?, to)
        } else {
            Err(io::ErrorKind::Unsupported.into())
        }
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        fs::remove_file(path)
    }

    fn create_folder(&self, path: &Path) -> io::Result<()> {
        fs::create_dir(path)
    }

    fn remove_folder(&self, path: &Path) -> io::Result<()> {
        fs::remove_dir(path)
    }

    fn list(&self, path: &Path) -> io::Result<Vec<String>> {
        let names = fs::read_dir(path)?.map(|entry| Ok(entry?.file_name().into_string().ok()));
        names.filter_map(io::Result::transpose).collect()
    }

    fn kind(&self, path: &Path) -> io::Result<Option<EntryKind>> {
        match fs::symlink_metadata(path) {
            Ok(metadata) if metadata.is_file() => Ok(Some(EntryKind::File(metadata.len()))),
            Ok(metadata) if metadata.is_dir() => Ok(Some(EntryKind::Folder)),
            Ok(_) => Ok(Some(EntryKind::Other)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error),
        }
    }

    fn resolve(&self, path: &Path) -> io::Result<PathBuf> {
        let absolute = std::path::absolute(path)?;
        for there in absolute.ancestors() {
            match there.canonicalize() {
                Ok(resolved) => {
                    let rest = absolute.strip_prefix(there).unwrap_or(Path::new(""));
                    return Ok(if rest.as_os_str().is_empty() { resolved } else { resolved.join(rest) });
                }
                Err(error)
                    if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(absolute)
    }

    fn lock(&self, path: &Path) -> io::Result<Option<Box<dyn Any + Send + Sync>>> {
        let file = OpenOptions::new().write(true).create(true).truncate(false).open(only_a_file(path)?)?;
        // A process that this one is just starting holds all its files for an instant, let go or not.
        for _ in 0..LOCK_ATTEMPTS {
            match file.try_lock() {
                Ok(()) => return Ok(Some(Box::new(file))),
                Err(TryLockError::WouldBlock) => thread::sleep(Duration::from_millis(1)),
                Err(TryLockError::Error(error)) => return Err(error),
            }
        }
        Ok(None)
    }
}

impl Read for FsRead {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.file.read(buffer)
    }
}

impl DiskRead for FsRead {
    fn file_bytes(&self) -> u64 {
        self.bytes
    }
}

impl ReaderWatch for File {
    fn has_readers(&self) -> bool {
        match self.try_lock() {
            Err(TryLockError::WouldBlock) => true,
            // Without locks no reader can hold one.
            Err(TryLockError::Error(_)) => false,
            Ok(()) => {
                // Closing the file would release it too.
                let _ = self.unlock();
                false
            }
        }
    }
}

impl DiskWrite for File {
    fn sync(&mut self) -> io::Result<()> {
        self.sync_all()
    }
}

/// Syncs many paths. A sync is waiting, not work: a file system that is asked for several at once writes them together.
fn at_once(paths: &[PathBuf], sync: impl Fn(&Path) -> io::Result<()> + Sync) -> Vec<io::Result<()>> {
    const AT_ONCE: usize = 16;
    if paths.len() < 2 {
        return paths.iter().map(|path| sync(path)).collect();
    }
    let next = AtomicUsize::new(0);
    let results: Vec<OnceLock<io::Result<()>>> = paths.iter().map(|_| OnceLock::new()).collect();
    let sync_next = || {
        while let Some(number) = Some(next.fetch_add(1, Ordering::Relaxed))
            && let Some(path) = paths.get(number)
        {
            let _ = results[number].set(sync(path));
        }
    };
    thread::scope(|scope| {
        for _ in 1..AT_ONCE.min(paths.len()) {
            // Where no thread is to be had, this one does it all.
            let _ = thread::Builder::new().spawn_scoped(scope, sync_next);
        }
        sync_next();
    });
    let never_tried = || Err(io::Error::other("the sync was not tried"));
    results.into_iter().map(|result| result.into_inner().unwrap_or_else(never_tried)).collect()
}

/// Whether a file has names beside this one.
fn has_other_names(path: &Path) -> bool {
    #[cfg(unix)]
    let names = |metadata: fs::Metadata| std::os::unix::fs::MetadataExt::nlink(&metadata);
    #[cfg(not(unix))]
    let names = |_: fs::Metadata| 1;
    fs::symlink_metadata(path).is_ok_and(|metadata| metadata.is_file() && names(metadata) > 1)
}

/// A link inside a map could lead anywhere, and a pipe would be waited for: only files are opened, and names that
/// nothing has.
fn only_a_file(path: &Path) -> io::Result<&Path> {
    match fs::symlink_metadata(path) {
        Ok(metadata) if !metadata.is_file() => {
            let reason = if metadata.is_symlink() {
                "a symbolic link; links inside a map are not followed"
            } else {
                "not a regular file"
            };
            Err(io::Error::new(io::ErrorKind::InvalidInput, reason))
        }
        _ => Ok(path),
    }
}
