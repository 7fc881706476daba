use std::io;
use voxtile_scratch::ScratchFile;

/// A file of nobody else's, for what has no room in memory for a while: it has no name, and goes when it is dropped.
pub trait Scratch: Send {
    /// Appends bytes. After an error nothing was appended.
    ///
    /// # Errors
    ///
    /// A disk that refuses.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Bytes at a place, of those that were appended.
    ///
    /// # Errors
    ///
    /// A disk that refuses; [`io::ErrorKind::UnexpectedEof`] behind the end.
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

/// In memory.
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
