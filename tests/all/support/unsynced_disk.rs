use std::any::Any;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use voxtile::store::{Disk, DiskRead, DiskWrite, EntryKind, FsDisk, ReaderWatch};

/// The file system without waiting for the medium: for tests that are not about crashes.
#[derive(Debug)]
pub struct UnsyncedDisk;

impl UnsyncedDisk {
    pub fn shared() -> Arc<dyn Disk> {
        Arc::new(Self)
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
        Ok(())
    }
}

impl Disk for UnsyncedDisk {
    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        FsDisk.open(path)
    }

    fn open_shared(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        FsDisk.open_shared(path)
    }

    fn watch(&self, path: &Path) -> io::Result<Box<dyn ReaderWatch>> {
        FsDisk.watch(path)
    }

    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskWrite>> {
        Ok(Box::new(Unsynced(FsDisk.create(path)?)))
    }

    fn append(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskWrite>> {
        Ok(Box::new(Unsynced(FsDisk.append(path, offset)?)))
    }

    fn sync_file(&self, _: &Path) -> io::Result<()> {
        Ok(())
    }

    fn sync_folder(&self, _: &Path) -> io::Result<()> {
        Ok(())
    }

    fn sync_all(&self, files: &[PathBuf], folders: &[PathBuf]) -> [Vec<io::Result<()>>; 2] {
        [files, folders].map(|paths| paths.iter().map(|_| Ok(())).collect())
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        FsDisk.rename(from, to)
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        FsDisk.remove_file(path)
    }

    fn create_folder(&self, path: &Path) -> io::Result<()> {
        FsDisk.create_folder(path)
    }

    fn remove_folder(&self, path: &Path) -> io::Result<()> {
        FsDisk.remove_folder(path)
    }

    fn list(&self, path: &Path) -> io::Result<Vec<String>> {
        FsDisk.list(path)
    }

    fn kind(&self, path: &Path) -> io::Result<Option<EntryKind>> {
        FsDisk.kind(path)
    }

    fn lock(&self, path: &Path) -> io::Result<Option<Box<dyn Any + Send + Sync>>> {
        FsDisk.lock(path)
    }
}
