use super::disk::{Disk, DiskLock, DiskRead, DiskWrite, EntryKind, ReaderWatch};
use crate::scratch::Scratch;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;
use voxtile_scratch::ScratchFile;

/// The file system of the operating system.
#[derive(Clone, Copy, Debug, Default)]
pub struct FsDisk;

/// Number of attempts to take a lock, one millisecond apart.
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

    fn open_at(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskRead>> {
        let mut file = File::open(only_a_file(path)?)?;
        let bytes = file.metadata()?.len();
        file.seek(SeekFrom::Start(offset))?;
        Ok(Box::new(FsRead { file, bytes }))
    }

    fn open_shared(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        let file = File::open(only_a_file(path)?)?;
        // A writer that checks for readers holds the lock for an instant.
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
            let reason = format!("{bytes} bytes, {offset} expected: another program changed the file");
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
        // Only Unix can open and sync a folder. On other systems renames are durable by themselves.
        if cfg!(unix) { File::open(path)?.sync_all() } else { Ok(()) }
    }

    fn sync_all(&self, files: &[PathBuf], folders: &[PathBuf]) -> [Vec<io::Result<()>>; 2] {
        [at_once(files, |path| self.sync_file(path)), at_once(folders, |path| self.sync_folder(path))]
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    #[cfg(target_os = "linux")]
    fn exchange(&self, first: &Path, second: &Path) -> io::Result<()> {
        use rustix::fs::{CWD, RenameFlags, renameat_with};
        Ok(renameat_with(CWD, first, CWD, second, RenameFlags::EXCHANGE)?)
    }

    fn link(&self, from: &Path, to: &Path) -> io::Result<()> {
        // Other systems do not report the number of hard links, see `has_other_names`.
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

    fn scratch(&self, folder: &Path) -> io::Result<Box<dyn Scratch>> {
        Ok(Box::new(ScratchFile::in_folder(folder)?))
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

    fn lock(&self, path: &Path) -> io::Result<Option<Box<dyn DiskLock>>> {
        // A child process being started holds copies of all our file handles for an instant, including released locks.
        for _ in 0..LOCK_ATTEMPTS {
            let lock = FsLock { file: open_for_writers(only_a_file(path)?)?, path: path.to_owned() };
            match lock.file.try_lock() {
                // Between open and lock another process may have removed the file and created a new one.
                Ok(()) if lock.is_in_place()? => return Ok(Some(Box::new(lock))),
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => thread::sleep(Duration::from_millis(1)),
                Err(TryLockError::Error(error)) => return Err(error),
            }
        }
        Ok(None)
    }
}

struct FsLock {
    file: File,
    path: PathBuf,
}

impl DiskLock for FsLock {
    #[cfg(unix)]
    fn is_in_place(&self) -> io::Result<bool> {
        use std::os::unix::fs::MetadataExt;
        let held = self.file.metadata()?;
        match fs::symlink_metadata(&self.path) {
            Ok(named) => Ok((named.dev(), named.ino()) == (held.dev(), held.ino())),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// An open file keeps its name on these systems.
    #[cfg(not(unix))]
    fn is_in_place(&self) -> io::Result<bool> {
        self.path.try_exists()
    }
}

/// Opens or creates the lock file such that only processes with write permission can open it. Read permission would
/// suffice to take the lock.
fn open_for_writers(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(false);
    #[cfg(unix)]
    {
        use std::os::unix::fs::{OpenOptionsExt, PermissionsExt};
        let file = options.mode(0o622).open(path)?;
        let mode = file.metadata()?.permissions().mode();
        // Group and others without write permission lose read permission.
        let unwritten = !(mode << 1) & 0o044;
        if mode & unwritten != 0 {
            // Only the owner can change the mode. For other users the file remains as it is.
            let _ = file.set_permissions(fs::Permissions::from_mode(mode & !unwritten));
        }
        Ok(file)
    }
    #[cfg(not(unix))]
    options.open(path)
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
            // Without locks, readers cannot be detected.
            Err(TryLockError::Error(_)) => false,
            Ok(()) => {
                // Dropping the file would release the lock too, but only later.
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

/// Syncs many paths concurrently: a file system combines concurrent syncs.
fn at_once(paths: &[PathBuf], sync: impl Fn(&Path) -> io::Result<()> + Sync) -> Vec<io::Result<()>> {
    const AT_ONCE: usize = 16;
    /// Enough for a system call. Sixteen default stacks would reserve 32 MiB of addresses at each flush.
    const STACK_BYTES: usize = 128 << 10;
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
            // If no thread can be started, this thread syncs all paths.
            let _ = thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, sync_next);
        }
        sync_next();
    });
    let never_tried = || Err(io::Error::other("the sync was not attempted"));
    results.into_iter().map(|result| result.into_inner().unwrap_or_else(never_tried)).collect()
}

/// Returns whether a file has more than one hard link.
fn has_other_names(path: &Path) -> bool {
    #[cfg(unix)]
    let names = |metadata: fs::Metadata| std::os::unix::fs::MetadataExt::nlink(&metadata);
    #[cfg(not(unix))]
    let names = |_: fs::Metadata| 1;
    fs::symlink_metadata(path).is_ok_and(|metadata| metadata.is_file() && names(metadata) > 1)
}

/// Rejects names of anything but regular files: a symbolic link could lead out of the map, and opening a FIFO blocks.
/// Names that do not exist are accepted.
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
