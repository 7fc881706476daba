use super::input_file::open_input;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use voxtile::Result;

/// Input of a scan stream.
pub(crate) trait StreamInput: Read {
    /// Skips bytes. Returns the number of bytes skipped, which is smaller at the end of the input.
    fn pass(&mut self, bytes: u64) -> io::Result<u64>;
}

/// Any reader. Bytes are skipped by reading them.
pub(crate) struct AnyInput<R>(pub(crate) R);

impl<R: Read> Read for AnyInput<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.0.read(buffer)
    }
}

impl<R: Read> StreamInput for AnyInput<R> {
    fn pass(&mut self, bytes: u64) -> io::Result<u64> {
        io::copy(&mut (&mut self.0).take(bytes), &mut io::sink())
    }
}

/// Unbuffered file. Points are read in large chunks, and skipped bytes are not read.
pub(crate) struct FileInput {
    file: File,
    at: u64,
    /// File size at the last query; the file may grow. 0 for a named pipe.
    known_bytes: u64,
    /// Whether the position changed and a seek is needed before the next read.
    has_passed: bool,
}

impl FileInput {
    pub(crate) fn open(path: &Path) -> Result<Self> {
        Ok(Self { file: open_input(path)?, at: 0, known_bytes: 0, has_passed: false })
    }
}

impl Read for FileInput {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.has_passed {
            self.file.seek(SeekFrom::Start(self.at))?;
            self.has_passed = false;
        }
        let read = self.file.read(buffer)?;
        self.at += read as u64;
        Ok(read)
    }
}

impl StreamInput for FileInput {
    fn pass(&mut self, bytes: u64) -> io::Result<u64> {
        if bytes > self.known_bytes.saturating_sub(self.at) {
            let metadata = self.file.metadata()?;
            if !metadata.is_file() {
                // A named pipe cannot seek, so read the bytes.
                let passed = io::copy(&mut (&mut self.file).take(bytes), &mut io::sink())?;
                self.at += passed;
                return Ok(passed);
            }
            self.known_bytes = metadata.len();
        }
        let passed = bytes.min(self.known_bytes.saturating_sub(self.at));
        self.at += passed;
        self.has_passed |= passed > 0;
        Ok(passed)
    }
}
