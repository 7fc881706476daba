use super::{Error, Result};
use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Output file. Its errors contain the path.
pub(super) struct OutFile {
    path: PathBuf,
    out: BufWriter<File>,
    /// Number of bytes written.
    len: u64,
}

impl OutFile {
    pub(super) fn create(path: &Path) -> Result<Self> {
        // Also readable: some format writers read back what they wrote.
        let mut options = File::options();
        let file = options.read(true).write(true).create(true).truncate(true).open(path);
        let file = file.map_err(|error| Error::io(path, "create", error))?;
        Ok(Self { path: path.to_owned(), out: BufWriter::with_capacity(1 << 17, file), len: 0 })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the number of bytes written.
    pub(super) fn len(&self) -> u64 {
        self.len
    }

    pub(super) fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.out.write_all(bytes).map_err(|error| self.refused(error))?;
        self.len += bytes.len() as u64;
        Ok(())
    }

    /// Appends the contents of another file.
    pub(super) fn append(&mut self, from: &mut dyn Read) -> Result<u64> {
        let copied = io::copy(from, &mut self.out).map_err(|error| self.refused(error))?;
        self.len += copied;
        Ok(copied)
    }

    pub(super) fn finish(mut self) -> Result<()> {
        self.out.flush().map_err(|error| self.refused(error))
    }

    fn refused(&self, error: io::Error) -> Error {
        Error::io(&self.path, "write", error)
    }
}

/// For libraries that seek while writing. [`OutFile::len`] then returns the end of the furthest write.
impl Write for OutFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.len += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

impl Seek for OutFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.out.seek(to)
    }
}

impl Read for OutFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.out.flush()?;
        self.out.get_mut().read(buffer)
    }
}
