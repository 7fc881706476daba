use super::disk::{Disk, DiskLock, DiskRead, DiskWrite, EntryKind, ReaderWatch};
use crate::scratch::Scratch;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Wraps a disk and ignores all syncs: writes are not durable, and a flush does not wait for the storage device.
///
/// For maps that are built again after a crash, such as the shards of a cluster build
/// ([`operations::move_shard`](crate::operations::move_shard()) later syncs each file once). Do not use it for a
/// permanent map: after a power failure its files may have any mixture of states.
#[derive(Clone, Debug)]
pub struct UnsyncedDisk {
    disk: Arc<dyn Disk>,
}

impl UnsyncedDisk {
    /// Wraps `disk`.
    pub fn of(disk: Arc<dyn Disk>) -> Self {
        Self { disk }
    }
}

struct Unsynced(Box<dyn DiskWrite>);

impl io::Write for Unsynced {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.0.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

impl DiskWrite for Unsynced {
    fn sync(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

impl Disk for UnsyncedDisk {
    fn sync_file(&self, _: &Path) -> io::Result<()> {
        Ok(())
    }

    fn sync_folder(&self, _: &Path) -> io::Result<()> {
        Ok(())
    }

    fn sync_all(&self, files: &[PathBuf], folders: &[PathBuf]) -> [Vec<io::Result<()>>; 2] {
        [files, folders].map(|paths| paths.iter().map(|_| Ok(())).collect())
    }

    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskWrite>> {
        Ok(Box::new(Unsynced(self.disk.create(path)?)))
    }

    fn append(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskWrite>> {
        Ok(Box::new(Unsynced(self.disk.append(path, offset)?)))
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        self.disk.open(path)
    }

    fn open_at(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskRead>> {
        self.disk.open_at(path, offset)
    }

    fn open_shared(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        self.disk.open_shared(path)
    }

    fn watch(&self, path: &Path) -> io::Result<Box<dyn ReaderWatch>> {
        self.disk.watch(path)
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.disk.rename(from, to)
    }

    fn exchange(&self, first: &Path, second: &Path) -> io::Result<()> {
        self.disk.exchange(first, second)
    }

    fn link(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.disk.link(from, to)
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        self.disk.remove_file(path)
    }

    fn create_folder(&self, path: &Path) -> io::Result<()> {
        self.disk.create_folder(path)
    }

    fn remove_folder(&self, path: &Path) -> io::Result<()> {
        self.disk.remove_folder(path)
    }

    fn list(&self, path: &Path) -> io::Result<Vec<String>> {
        self.disk.list(path)
    }

    fn scratch(&self, folder: &Path) -> io::Result<Box<dyn Scratch>> {
        self.disk.scratch(folder)
    }

    fn kind(&self, path: &Path) -> io::Result<Option<EntryKind>> {
        self.disk.kind(path)
    }

    fn resolve(&self, path: &Path) -> io::Result<PathBuf> {
        self.disk.resolve(path)
    }

    fn lock(&self, path: &Path) -> io::Result<Option<Box<dyn DiskLock>>> {
        self.disk.lock(path)
    }

    fn files_ahead(&self) -> usize {
        self.disk.files_ahead()
    }

    fn read_ahead(&self, path: &Path) {
        self.disk.read_ahead(path);
    }

    fn pause(&self) {
        self.disk.pause();
    }
}
