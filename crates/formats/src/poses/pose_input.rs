use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use voxtile::{Error, Result};

/// Reader of a pose file that is opened only once, because a pipe cannot be read again.
pub(super) struct PoseInput {
    head: Vec<u8>,
    /// Number of bytes of `head` already consumed.
    taken: usize,
    rest: BufReader<File>,
}

/// Number of bytes used to detect the kind of file.
const HEAD_BYTES: u64 = 4096;

impl PoseInput {
    pub(super) fn open(path: &Path) -> Result<Self> {
        let fail = |error| Error::io(path, "read", error);
        let mut rest = BufReader::with_capacity(1 << 16, File::open(path).map_err(fail)?);
        let mut head = Vec::new();
        (&mut rest).take(HEAD_BYTES).read_to_end(&mut head).map_err(fail)?;
        Ok(Self { head, taken: 0, rest })
    }

    pub(super) fn head(&self) -> &[u8] {
        &self.head
    }
}

impl Read for PoseInput {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for PoseInput {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        match self.head.get(self.taken..) {
            Some(left) if !left.is_empty() => Ok(left),
            _ => self.rest.fill_buf(),
        }
    }

    fn consume(&mut self, count: usize) {
        if self.taken < self.head.len() {
            self.taken += count;
        } else {
            self.rest.consume(count);
        }
    }
}
