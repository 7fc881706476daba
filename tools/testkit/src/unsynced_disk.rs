use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;
use voxtile::store::{Disk, DiskLock, DiskRead, DiskWrite, EntryKind, FsDisk, ReaderWatch, Scratch};

/// The file system without syncs, for tests that do not simulate crashes.
#[derive(Debug)]
pub struct UnsyncedDisk {
    /// Simulated duration of a sync.
    sync_time: Duration,
    /// Delay of each new file on the background saving thread.
    background_time: Duration,
    /// Delay of each opened file on the thread of this name.
    read_time: Option<(&'static str, Duration)>,
    /// While this is locked, the background flush thread creates no file.
    gate: Arc<Mutex<()>>,
}

impl UnsyncedDisk {
    pub fn shared() -> Arc<dyn Disk> {
        Arc::new(Self::new())
    }

    fn new() -> Self {
        let (sync_time, background_time) = (Duration::ZERO, Duration::ZERO);
        Self { sync_time, background_time, read_time: None, gate: Arc::default() }
    }

    /// A disk whose syncs take this time, 16 at once, independent of the bytes written.
    pub fn with_sync_time(sync_time: Duration) -> Arc<dyn Disk> {
        Arc::new(Self { sync_time, ..Self::new() })
    }

    /// A disk that is slow for the background saving thread, so that the mapping thread gets ahead.
    #[allow(dead_code, reason = "benches share this file")]
    pub fn slow_in_background(background_time: Duration) -> Arc<dyn Disk> {
        Arc::new(Self { background_time, ..Self::new() })
    }

    /// A disk that is slow to open files for reading on the thread of this name.
    #[allow(dead_code, reason = "benches share this file")]
    pub fn slow_to_read_for(thread: &'static str, read_time: Duration) -> Arc<dyn Disk> {
        Arc::new(Self { read_time: Some((thread, read_time)), ..Self::new() })
    }

    /// A disk on which the background flush thread creates no file while `gate` is locked.
    #[allow(dead_code, reason = "benches share this file")]
    pub fn gated(gate: &Arc<Mutex<()>>) -> Arc<dyn Disk> {
        Arc::new(Self { gate: gate.clone(), ..Self::new() })
    }
}

fn wait(time: Duration) {
    if !time.is_zero() {
        thread::sleep(time);
    }
}

struct Unsynced(Box<dyn DiskWrite>, Duration);

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
        wait(self.1);
        Ok(())
    }
}

impl Disk for UnsyncedDisk {
    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        if let Some((thread, time)) = self.read_time
            && thread::current().name() == Some(thread)
        {
            wait(time);
        }
        FsDisk.open(path)
    }

    fn open_shared(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        FsDisk.open_shared(path)
    }

    fn watch(&self, path: &Path) -> io::Result<Box<dyn ReaderWatch>> {
        FsDisk.watch(path)
    }

    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskWrite>> {
        match thread::current().name() {
            Some("voxtile-save") => wait(self.background_time),
            Some("voxtile-flush") => drop(self.gate.lock().unwrap_or_else(PoisonError::into_inner)),
            _ => {}
        }
        Ok(Box::new(Unsynced(FsDisk.create(path)?, self.sync_time)))
    }

    fn append(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskWrite>> {
        Ok(Box::new(Unsynced(FsDisk.append(path, offset)?, self.sync_time)))
    }

    fn sync_file(&self, _: &Path) -> io::Result<()> {
        wait(self.sync_time);
        Ok(())
    }

    fn sync_folder(&self, _: &Path) -> io::Result<()> {
        wait(self.sync_time);
        Ok(())
    }

    fn sync_all(&self, files: &[PathBuf], folders: &[PathBuf]) -> [Vec<io::Result<()>>; 2] {
        [files, folders].map(|paths| {
            wait(self.sync_time * paths.len().div_ceil(16) as u32);
            paths.iter().map(|_| Ok(())).collect()
        })
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        FsDisk.rename(from, to)
    }

    fn link(&self, from: &Path, to: &Path) -> io::Result<()> {
        FsDisk.link(from, to)
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

    fn scratch(&self, folder: &Path) -> io::Result<Box<dyn Scratch>> {
        FsDisk.scratch(folder)
    }

    fn kind(&self, path: &Path) -> io::Result<Option<EntryKind>> {
        FsDisk.kind(path)
    }

    fn lock(&self, path: &Path) -> io::Result<Option<Box<dyn DiskLock>>> {
        FsDisk.lock(path)
    }
}
