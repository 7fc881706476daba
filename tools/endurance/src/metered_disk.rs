use crate::bucket::Bucket;
use serde::{Deserialize, Serialize};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use voxtile::store::{Disk, DiskLock, DiskRead, DiskWrite, EntryKind, FsDisk, ReaderWatch, Scratch};

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum DiskSpeed {
    /// The real speed.
    Own,
    /// At most this many bytes a second, reads and writes together. A write waits for its bytes and a sync for all
    /// earlier writes: there is no cache that hides them.
    BytesPerSecond(f64),
    /// The same, with the delays of a memory card.
    Card(Card),
    /// No syncs, for measurements that do not depend on time.
    Unsynced,
}

/// Speed and delays of a memory card.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Card {
    /// Reads and writes together.
    pub bytes_per_s: f64,
    /// Delay of a sync, in seconds. Files that are synced together share it, and so do folders.
    pub sync_s: f64,
    /// Delay of a file that is opened or created, or read at a place of its own, in seconds.
    pub access_s: f64,
}

/// The file system, with a simulated speed and counters of the bytes read and written.
#[derive(Debug)]
pub struct MeteredDisk {
    meter: Arc<Meter>,
    is_synced: bool,
}

/// Counts bytes read and written.
#[derive(Debug, Default)]
pub struct Meter {
    bytes_read: AtomicU64,
    bytes_written: AtomicU64,
    accesses: AtomicU64,
    syncs: AtomicU64,
    bucket: Option<Bucket>,
    sync: Duration,
    access: Duration,
}

struct Metered<T> {
    file: T,
    meter: Arc<Meter>,
    is_synced: bool,
}

impl MeteredDisk {
    /// Wraps the file system, at this speed.
    pub fn new(speed: DiskSpeed) -> Self {
        let card = match speed {
            DiskSpeed::BytesPerSecond(bytes_per_s) => Some(Card { bytes_per_s, sync_s: 0.0, access_s: 0.0 }),
            DiskSpeed::Card(card) => Some(card),
            DiskSpeed::Own | DiskSpeed::Unsynced => None,
        };
        let meter = Arc::new(card.map_or_else(Meter::default, Meter::of));
        Self { meter, is_synced: speed != DiskSpeed::Unsynced }
    }

    pub fn meter(&self) -> Arc<Meter> {
        self.meter.clone()
    }

    fn metered<T>(&self, file: T) -> Metered<T> {
        Metered { file, meter: self.meter.clone(), is_synced: self.is_synced }
    }

    fn sync(&self, path: &Path, sync: impl Fn(&FsDisk, &Path) -> io::Result<()>) -> io::Result<()> {
        self.meter.sync(1);
        if self.is_synced { sync(&FsDisk, path) } else { Ok(()) }
    }
}

impl Meter {
    fn of(card: Card) -> Self {
        Self {
            bucket: Some(Bucket::new(card.bytes_per_s)),
            sync: Duration::from_secs_f64(card.sync_s),
            access: Duration::from_secs_f64(card.access_s),
            ..Self::default()
        }
    }

    pub fn bytes_read(&self) -> u64 {
        self.bytes_read.load(Ordering::Relaxed)
    }

    pub fn bytes_written(&self) -> u64 {
        self.bytes_written.load(Ordering::Relaxed)
    }

    /// Number of files opened or created, and of reads at a place of their own.
    pub fn accesses(&self) -> u64 {
        self.accesses.load(Ordering::Relaxed)
    }

    /// Number of syncs; files that are synced together count once.
    pub fn syncs(&self) -> u64 {
        self.syncs.load(Ordering::Relaxed)
    }

    fn count(&self, counter: &AtomicU64, bytes: usize) {
        counter.fetch_add(bytes as u64, Ordering::Relaxed);
        if let Some(bucket) = &self.bucket {
            bucket.take(bytes);
        }
    }

    /// Waits for all earlier writes and for syncs, one after another.
    fn sync(&self, syncs: u32) {
        self.syncs.fetch_add(syncs.into(), Ordering::Relaxed);
        if let Some(bucket) = &self.bucket {
            bucket.occupy(syncs * self.sync);
            bucket.drain();
        }
    }

    /// Waits for the access to a file.
    fn access(&self) {
        self.accesses.fetch_add(1, Ordering::Relaxed);
        if let Some(bucket) = &self.bucket {
            bucket.occupy(self.access);
        }
    }
}

impl Read for Metered<Box<dyn DiskRead>> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let bytes = self.file.read(buffer)?;
        self.meter.count(&self.meter.bytes_read, bytes);
        Ok(bytes)
    }
}

impl DiskRead for Metered<Box<dyn DiskRead>> {
    fn file_bytes(&self) -> u64 {
        self.file.file_bytes()
    }
}

impl Write for Metered<Box<dyn DiskWrite>> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let bytes = self.file.write(buffer)?;
        self.meter.count(&self.meter.bytes_written, bytes);
        Ok(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl DiskWrite for Metered<Box<dyn DiskWrite>> {
    fn sync(&mut self) -> io::Result<()> {
        self.meter.sync(1);
        if self.is_synced { self.file.sync() } else { Ok(()) }
    }
}

impl Disk for MeteredDisk {
    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        self.meter.access();
        Ok(Box::new(self.metered(FsDisk.open(path)?)))
    }

    fn open_at(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskRead>> {
        self.meter.access();
        Ok(Box::new(self.metered(FsDisk.open_at(path, offset)?)))
    }

    fn read_at(&self, path: &Path, offset: u64, bytes: usize) -> io::Result<Vec<u8>> {
        self.meter.access();
        let read = FsDisk.read_at(path, offset, bytes)?;
        self.meter.count(&self.meter.bytes_read, read.len());
        Ok(read)
    }

    fn open_shared(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        Ok(Box::new(self.metered(FsDisk.open_shared(path)?)))
    }

    fn watch(&self, path: &Path) -> io::Result<Box<dyn ReaderWatch>> {
        FsDisk.watch(path)
    }

    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskWrite>> {
        self.meter.access();
        Ok(Box::new(self.metered(FsDisk.create(path)?)))
    }

    fn append(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskWrite>> {
        self.meter.access();
        Ok(Box::new(self.metered(FsDisk.append(path, offset)?)))
    }

    fn sync_file(&self, path: &Path) -> io::Result<()> {
        self.sync(path, FsDisk::sync_file)
    }

    fn sync_folder(&self, path: &Path) -> io::Result<()> {
        self.sync(path, FsDisk::sync_folder)
    }

    fn sync_all(&self, files: &[PathBuf], folders: &[PathBuf]) -> [Vec<io::Result<()>>; 2] {
        self.meter.sync(u32::from(!files.is_empty()) + u32::from(!folders.is_empty()));
        if self.is_synced {
            return FsDisk.sync_all(files, folders);
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    #[test]
    fn bytes_are_counted_and_reads_and_writes_take_time_on_a_slow_disk() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let disk = MeteredDisk::new(DiskSpeed::BytesPerSecond(1e6));
        let begin = Instant::now();
        let mut file = disk.create(&path).unwrap();
        file.write_all(&[7; 30_000]).unwrap();
        file.sync().unwrap();
        let mut read = Vec::new();
        disk.open(&path).unwrap().read_to_end(&mut read).unwrap();
        assert_eq!(read, [7; 30_000]);
        let meter = disk.meter();
        assert_eq!([meter.bytes_written(), meter.bytes_read()], [30_000; 2]);
        assert!(begin.elapsed() >= Duration::from_millis(58), "{:?}", begin.elapsed());
    }

    #[test]
    fn a_card_delays_accesses_and_syncs() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let card = Card { bytes_per_s: 1e9, sync_s: 0.02, access_s: 0.01 };
        let disk = MeteredDisk::new(DiskSpeed::Card(card));
        let begin = Instant::now();
        disk.create(&path).unwrap().write_all(&[7; 100]).unwrap();
        // Files that are synced together share a delay.
        let [files, folders] = disk.sync_all(&[path.clone(), path.clone()], &[folder.path().to_owned()]);
        assert_eq!([files.len(), folders.len()], [2, 1]);
        assert_eq!(disk.read_at(&path, 90, 20).unwrap(), [7; 10]);
        assert!(begin.elapsed() >= Duration::from_millis(58), "{:?}", begin.elapsed());
        let meter = disk.meter();
        assert_eq!([meter.bytes_written(), meter.bytes_read()], [100, 10]);
        assert_eq!([meter.accesses(), meter.syncs()], [2, 2]);
    }

    #[test]
    fn a_sync_waits_for_the_last_write() {
        let folder = tempfile::tempdir().unwrap();
        let disk = MeteredDisk::new(DiskSpeed::BytesPerSecond(1e5));
        let begin = Instant::now();
        // Too few bytes for the write to wait.
        disk.create(&folder.path().join("file")).unwrap().write_all(&[7; 150]).unwrap();
        disk.sync_folder(folder.path()).unwrap();
        assert!(begin.elapsed() >= Duration::from_micros(1_400), "{:?}", begin.elapsed());
    }
}
