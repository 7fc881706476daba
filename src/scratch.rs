use std::io;
use voxtile_scratch::ScratchFile;

/// Unnamed file for data that temporarily exceeds memory. It is deleted when it is dropped.
pub trait Scratch: Send {
    /// Appends bytes. After an error nothing is appended.
    ///
    /// # Errors
    ///
    /// An I/O error.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Returns `count` of the appended bytes, from offset `at`.
    ///
    /// # Errors
    ///
    /// An I/O error, or [`io::ErrorKind::UnexpectedEof`] beyond the end.
    fn bytes(&mut self, at: u64, count: usize) -> io::Result<&[u8]>;
}

impl Scratch for ScratchFile {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        Self::append(self, bytes)
    }

    fn bytes(&mut self, at: u64, count: usize) -> io::Result<&[u8]> {
        Self::bytes(self, at, count)
    }
}

/// Scratch data in memory.
impl Scratch for Vec<u8> {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.extend_from_slice(bytes);
        Ok(())
    }

    fn bytes(&mut self, at: u64, count: usize) -> io::Result<&[u8]> {
        let from = usize::try_from(at).ok().and_then(|at| self.get(at..));
        from.and_then(|bytes| bytes.get(..count)).ok_or_else(|| io::ErrorKind::UnexpectedEof.into())
    }
}
