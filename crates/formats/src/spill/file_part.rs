use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use voxtile::{Error, Result};

/// Part of a file that several readers share.
#[derive(Clone, Debug)]
pub(crate) struct FilePart {
    file: Arc<Mutex<File>>,
    /// Path of the file, or of the folder for an unnamed temporary file.
    path: Arc<Path>,
    start: u64,
    len: u64,
}

impl FilePart {
    pub(super) fn new(file: Arc<Mutex<File>>, path: Arc<Path>, start: u64, len: u64) -> Self {
        Self { file, path, start, len }
    }

    /// Opens a part of a file with a handle of its own. The caller ensures that the file has these bytes.
    #[cfg(feature = "ros")]
    pub(crate) fn open(path: &Path, start: u64, len: u64) -> Result<Self> {
        let file = File::open(path).map_err(|error| Error::io(path, "read", error))?;
        Ok(Self::new(Arc::new(Mutex::new(file)), path.into(), start, len))
    }

    #[cfg(feature = "ros")]
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    #[cfg(all(test, feature = "ros"))]
    pub(crate) fn has_handle_of(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.file, &other.file)
    }

    pub(crate) fn len(&self) -> u64 {
        self.len
    }

    /// Returns a part of this part, limited to its end.
    #[cfg(feature = "ros")]
    pub(crate) fn part(&self, start: u64, len: u64) -> Self {
        let start = start.min(self.len);
        Self { start: self.start + start, len: len.min(self.len - start), ..self.clone() }
    }

    /// Returns a reader that starts at the beginning of the part.
    #[cfg(feature = "ros")]
    pub(crate) fn reader(&self) -> impl Read + use<> {
        std::io::BufReader::with_capacity(1 << 16, PartReader { part: self.clone(), at: 0 })
    }

    /// Fills the buffer from an offset in the part.
    pub(crate) fn read_at(&self, at: u64, buffer: &mut [u8]) -> Result<()> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let read =
            file.seek(SeekFrom::Start(self.start.saturating_add(at))).and_then(|_| file.read_exact(buffer));
        read.map_err(|error| Error::io(&self.path, "read", error))
    }
}

/// Sequential reader of a part.
#[cfg(feature = "ros")]
struct PartReader {
    part: FilePart,
    at: u64,
}

#[cfg(feature = "ros")]
impl Read for PartReader {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let left = usize::try_from(self.part.len - self.at).unwrap_or(usize::MAX);
        let count = buffer.len().min(left);
        let taken = buffer.get_mut(..count).unwrap_or_default();
        self.part.read_at(self.at, taken).map_err(std::io::Error::other)?;
        self.at += count as u64;
        Ok(count)
    }
}
