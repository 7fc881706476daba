use shuttle::sync::{Arc, Mutex, MutexGuard};
use std::collections::BTreeMap;
use std::io::{self, Cursor, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use voxtile::store::{Disk, DiskLock, DiskRead, DiskWrite, EntryKind, ReaderWatch, Scratch};

/// A disk in memory that yields to other threads at each operation, and can refuse new files of tiles.
#[derive(Clone, Debug)]
pub(super) struct MemoryDisk {
    state: Arc<Mutex<State>>,
}

#[derive(Debug, Default)]
struct State {
    names: BTreeMap<PathBuf, Entry>,
    refuses: bool,
    refused: u64,
    /// Number of times each file of a tile was created.
    begun: BTreeMap<PathBuf, u64>,
}

/// No thread waits while it holds this lock, so the scheduler does not need to control it.
type Content = std::sync::Arc<std::sync::Mutex<Vec<u8>>>;

#[derive(Clone, Debug)]
enum Entry {
    Folder,
    File(Content),
}

impl MemoryDisk {
    /// Creates an empty disk with the folder `/`.
    pub(super) fn new() -> Self {
        let names = BTreeMap::from([(PathBuf::from("/"), Entry::Folder)]);
        Self { state: Arc::new(Mutex::new(State { names, ..State::default() })) }
    }

    /// Sets whether new files of tiles are refused.
    pub(super) fn refuse(&self, refuses: bool) {
        self.lock().refuses = refuses;
    }

    /// Number of refused files.
    pub(super) fn refused(&self) -> u64 {
        self.lock().refused
    }

    /// Returns the number of times a file was created.
    pub(super) fn begun(&self, path: &Path) -> u64 {
        self.lock().begun.get(path).copied().unwrap_or_default()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap()
    }

    fn content(&self, path: &Path) -> io::Result<Content> {
        match self.lock().names.get(path) {
            Some(Entry::File(content)) => Ok(content.clone()),
            Some(Entry::Folder) => Err(ErrorKind::InvalidInput.into()),
            None => Err(ErrorKind::NotFound.into()),
        }
    }
}

struct Reading(Cursor<Vec<u8>>);

impl Read for Reading {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.0.read(buffer)
    }
}

impl DiskRead for Reading {
    fn file_bytes(&self) -> u64 {
        self.0.get_ref().len() as u64
    }
}

struct Writing(Content);

impl Write for Writing {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl DiskWrite for Writing {
    fn sync(&mut self) -> io::Result<()> {
        Ok(())
    }
}

struct SingleProcess;

impl ReaderWatch for SingleProcess {
    fn has_readers(&self) -> bool {
        false
    }
}

impl DiskLock for SingleProcess {
    fn is_in_place(&self) -> io::Result<bool> {
        Ok(true)
    }
}

impl Disk for MemoryDisk {
    fn open(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        let content = self.content(path)?.lock().unwrap().clone();
        Ok(Box::new(Reading(Cursor::new(content))))
    }

    fn open_shared(&self, path: &Path) -> io::Result<Box<dyn DiskRead>> {
        self.open(path)
    }

    fn watch(&self, _: &Path) -> io::Result<Box<dyn ReaderWatch>> {
        Ok(Box::new(SingleProcess))
    }

    fn create(&self, path: &Path) -> io::Result<Box<dyn DiskWrite>> {
        let mut state = self.lock();
        if path.parent().is_some_and(|folder| folder.to_string_lossy().contains("tile_")) {
            if state.refuses {
                state.refused += 1;
                return Err(ErrorKind::StorageFull.into());
            }
            *state.begun.entry(path.to_owned()).or_default() += 1;
        }
        let content = Content::default();
        state.names.insert(path.to_owned(), Entry::File(content.clone()));
        Ok(Box::new(Writing(content)))
    }

    fn append(&self, path: &Path, offset: u64) -> io::Result<Box<dyn DiskWrite>> {
        let content = self.content(path)?;
        content.lock().unwrap().truncate(offset as usize);
        Ok(Box::new(Writing(content)))
    }

    fn sync_file(&self, path: &Path) -> io::Result<()> {
        self.content(path).map(drop)
    }

    fn sync_folder(&self, _: &Path) -> io::Result<()> {
        Ok(())
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        let mut state = self.lock();
        let entry = state.names.remove(from).ok_or(ErrorKind::NotFound)?;
        state.names.insert(to.to_owned(), entry);
        Ok(())
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        self.lock().names.remove(path).map(drop).ok_or(ErrorKind::NotFound.into())
    }

    fn create_folder(&self, path: &Path) -> io::Result<()> {
        self.lock().names.insert(path.to_owned(), Entry::Folder);
        Ok(())
    }

    fn remove_folder(&self, path: &Path) -> io::Result<()> {
        self.remove_file(path)
    }

    fn list(&self, path: &Path) -> io::Result<Vec<String>> {
        let state = self.lock();
        let inside = state.names.keys().filter(|name| name.parent() == Some(path));
        Ok(inside.filter_map(|name| Some(name.file_name()?.to_str()?.to_owned())).collect())
    }

    fn scratch(&self, _: &Path) -> io::Result<Box<dyn Scratch>> {
        Ok(Box::new(Vec::new()))
    }

    fn kind(&self, path: &Path) -> io::Result<Option<EntryKind>> {
        let entry = self.lock().names.get(path).cloned();
        Ok(entry.map(|entry| match entry {
            Entry::Folder => EntryKind::Folder,
            Entry::File(content) => EntryKind::File(content.lock().unwrap().len() as u64),
        }))
    }

    fn lock(&self, path: &Path) -> io::Result<Option<Box<dyn DiskLock>>> {
        self.lock().names.entry(path.to_owned()).or_insert(Entry::File(Content::default()));
        Ok(Some(Box::new(SingleProcess)))
    }
}
