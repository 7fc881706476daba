use super::disk::FaultyDisk;
use super::names::{Entry, Inode};
use super::operation::{Kind, Verdict};
use super::state::medium_error;
use std::io::{self, Read, Write};
use std::path::PathBuf;
use voxtile::store::{DiskLock, DiskRead, DiskWrite, ReaderWatch, Scratch};

/// A file open for reading, with the content at the time of opening.
pub(super) struct Reader {
    pub(super) disk: FaultyDisk,
    pub(super) path: PathBuf,
    pub(super) bytes: Vec<u8>,
    pub(super) at: usize,
    pub(super) shared: Option<Inode>,
}

impl Read for Reader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut state = self.disk.state();
        state.attempt(Kind::Reads, &self.path)?;
        let bad = state.unreadable.get(&self.path).cloned().unwrap_or_default();
        drop(state);
        if bad.contains(&self.at) {
            return Err(medium_error());
        }
        let end = if self.at < bad.start { bad.start.min(self.bytes.len()) } else { self.bytes.len() };
        let count = (&self.bytes[self.at..end]).read(buffer)?;
        self.at += count;
        Ok(count)
    }
}

impl DiskRead for Reader {
    fn file_bytes(&self) -> u64 {
        self.bytes.len() as u64
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        if let Some(inode) = self.shared {
            self.disk.state().content(inode).readers -= 1;
        }
    }
}

/// A file open for writing.
pub(super) struct Writer {
    pub(super) disk: FaultyDisk,
    pub(super) path: PathBuf,
    pub(super) inode: Inode,
}

impl Write for Writer {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let mut state = self.disk.state();
        let verdict = state.operation(Kind::NeedsSpace, &self.path);
        let content = state.content(self.inode);
        // New data must be synced again.
        content.lost = false;
        match verdict {
            Verdict::Succeeds => {
                content.seen.extend_from_slice(buffer);
                Ok(buffer.len())
            }
            Verdict::Fails(error) => {
                content.seen.extend_from_slice(&buffer[..buffer.len() / 2]);
                Err(error)
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl DiskWrite for Writer {
    fn sync(&mut self) -> io::Result<()> {
        self.disk.state().sync(self.inode, &self.path)
    }
}

/// Reports whether a file has readers.
pub(super) struct Watch {
    pub(super) disk: FaultyDisk,
    pub(super) inode: Inode,
}

impl ReaderWatch for Watch {
    fn has_readers(&self) -> bool {
        self.disk.state().content(self.inode).readers > 0
    }
}

/// A held lock, released on drop.
pub(super) struct Locked {
    pub(super) disk: FaultyDisk,
    pub(super) inode: Inode,
    pub(super) path: PathBuf,
}

impl DiskLock for Locked {
    fn is_in_place(&self) -> io::Result<bool> {
        let mut state = self.disk.state();
        state.attempt(Kind::Reads, &self.path)?;
        // The lock file moves when an unfinished map is renamed to its final name.
        Ok(state.names.get(&self.path) == Some(&Entry::File(self.inode)))
    }
}

impl Drop for Locked {
    fn drop(&mut self) {
        self.disk.state().content(self.inode).locked = false;
    }
}

/// An unnamed file, of which nothing remains after a crash.
pub(super) struct ScratchFile {
    pub(super) disk: FaultyDisk,
    pub(super) folder: PathBuf,
    pub(super) content: Vec<u8>,
}

impl Scratch for ScratchFile {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.disk.state().attempt(Kind::NeedsSpace, &self.folder)?;
        Scratch::append(&mut self.content, bytes)
    }

    fn bytes(&mut self, at: u64, count: usize) -> io::Result<&[u8]> {
        self.disk.state().attempt(Kind::Reads, &self.folder)?;
        self.content.bytes(at, count)
    }
}
