use std::io::{self, Read, Write};

/// Length and checksum of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FileChecksum {
    /// Length in bytes.
    pub bytes: u64,
    /// CRC-32 of all bytes.
    pub crc: u32,
}

/// Stream that computes the checksum of the bytes read or written through it.
pub struct Checksumming<S> {
    stream: S,
    bytes: u64,
    crc: crc32fast::Hasher,
    has_failed: bool,
}

impl<S> Checksumming<S> {
    /// Wraps a stream at its current position.
    pub fn new(stream: S) -> Self {
        Self { stream, bytes: 0, crc: crc32fast::Hasher::new(), has_failed: false }
    }

    /// Returns the checksum of all bytes so far, and the stream.
    pub fn finish(self) -> (FileChecksum, S) {
        (FileChecksum { bytes: self.bytes, crc: self.crc.finalize() }, self.stream)
    }

    /// Returns whether a read has failed. After a failed copy this distinguishes a read error from a write error.
    pub fn has_failed(&self) -> bool {
        self.has_failed
    }

    fn pass(&mut self, chunk: &[u8]) {
        self.bytes += chunk.len() as u64;
        self.crc.update(chunk);
    }
}

impl<W: Write> Write for Checksumming<W> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let written = self.stream.write(buffer)?;
        self.pass(&buffer[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

impl<R: Read> Read for Checksumming<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.stream.read(buffer).inspect_err(|_| self.has_failed = true)?;
        self.pass(&buffer[..read]);
        Ok(read)
    }
}
