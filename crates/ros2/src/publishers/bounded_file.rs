use std::io::{self, Cursor, Error, ErrorKind, Read, Seek, SeekFrom, Write};

/// In-memory file that is limited to the size of a message.
#[derive(Debug, Default)]
pub struct BoundedFile(Cursor<Vec<u8>>);

/// Maximum size of a message: larger ones are not delivered over DDS.
const MAX_BYTES: usize = 64 << 20;

impl BoundedFile {
    pub fn into_bytes(self) -> Vec<u8> {
        self.0.into_inner()
    }
}

impl Write for BoundedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let end = self.0.position().saturating_add(bytes.len() as u64);
        if end > MAX_BYTES as u64 {
            let reason = format!("the octree has more than {MAX_BYTES} bytes: use a smaller box");
            return Err(Error::new(ErrorKind::FileTooLarge, reason));
        }
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Read for BoundedFile {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.0.read(buffer)
    }
}

impl Seek for BoundedFile {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.0.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_write_beyond_the_limit_fails_and_changes_nothing() {
        let mut file = BoundedFile::default();
        file.write_all(&[7; 3]).unwrap();
        file.seek(SeekFrom::Start(MAX_BYTES as u64 - 1)).unwrap();
        assert_eq!(file.write(&[1; 2]).unwrap_err().kind(), ErrorKind::FileTooLarge);
        assert_eq!(file.into_bytes(), [7; 3]);
    }
}
