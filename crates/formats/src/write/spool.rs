use super::{Error, Result};
use std::fs::File;
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Unnamed temporary file for bytes whose final position is not known yet.
pub(super) struct Spool {
    folder: PathBuf,
    out: BufWriter<File>,
    len: u64,
}

impl Spool {
    pub(super) fn new(folder: &Path) -> Result<Self> {
        let file = tempfile::tempfile_in(folder)
            .map_err(|error| Error::io(folder, "make a temporary file in", error))?;
        Ok(Self { folder: folder.to_owned(), out: BufWriter::with_capacity(1 << 16, file), len: 0 })
    }

    /// Returns the number of bytes written.
    pub(super) fn len(&self) -> u64 {
        self.len
    }

    pub(super) fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.out.write_all(bytes).map_err(|error| refused(&self.folder, error))?;
        self.len += bytes.len() as u64;
        Ok(())
    }

    /// Returns a reader that starts at the beginning.
    pub(super) fn into_reader(mut self) -> Result<SpoolReader> {
        let folder = self.folder.clone();
        self.out.flush().map_err(|error| refused(&folder, error))?;
        let mut file = self.out.into_inner().map_err(|error| refused(&folder, error.into_error()))?;
        file.seek(SeekFrom::Start(0)).map_err(|error| refused(&folder, error))?;
        Ok(SpoolReader { folder, file, len: self.len })
    }
}

pub(super) struct SpoolReader {
    folder: PathBuf,
    file: File,
    len: u64,
}

impl SpoolReader {
    /// Returns the file, positioned at its start.
    pub(super) fn file(&mut self) -> &mut File {
        &mut self.file
    }

    /// Reads up to `most` bytes at an offset, fewer at the end.
    pub(super) fn read_at(&mut self, offset: u64, buffer: &mut Vec<u8>, most: u64) -> Result<()> {
        buffer.clear();
        let failed = |error| Error::io(&self.folder, "read a temporary file in", error);
        self.file.seek(SeekFrom::Start(offset)).map_err(failed)?;
        let most = most.min(self.len.saturating_sub(offset));
        let read = (&mut self.file).take(most).read_to_end(buffer).map_err(failed)?;
        if read as u64 != most {
            return Err(failed(std::io::ErrorKind::UnexpectedEof.into()));
        }
        Ok(())
    }
}

fn refused(folder: &Path, error: std::io::Error) -> Error {
    Error::io(folder, "write a temporary file in", error)
}
