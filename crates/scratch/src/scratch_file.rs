use crate::mapping::map;
use crate::window::Window;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// Unnamed file that is only appended to. It is deleted when it is dropped, or when the process ends.
#[derive(Debug)]
pub struct ScratchFile {
    file: File,
    len: u64,
    /// Whether the position of `file` is its end.
    is_at_end: bool,
    /// Buffer of the last read; `read_at` is its offset in the file.
    read: Vec<u8>,
    read_at: u64,
}

/// Bytes per read, so that a small record is read with its header.
const READ_BYTES: usize = 4096;

impl ScratchFile {
    /// Creates an empty file on the file system of a folder.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn in_folder(folder: &Path) -> io::Result<Self> {
        let file = tempfile::tempfile_in(folder)?;
        Ok(Self { file, len: 0, is_at_end: true, read: Vec::new(), read_at: 0 })
    }

    /// Length in bytes.
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Returns whether the file is empty.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Appends bytes. After an error the length is unchanged.
    ///
    /// # Errors
    ///
    /// An I/O error.
    pub fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        if !self.is_at_end {
            self.file.seek(SeekFrom::Start(self.len))?;
        }
        self.is_at_end = false;
        self.file.write_all(bytes)?;
        self.is_at_end = true;
        self.len += bytes.len() as u64;
        Ok(())
    }

    /// Returns a copy of bytes at any offset. A mapping is faster, but keeps up to 1 MiB around each access in memory.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::UnexpectedEof`] beyond the end, or an I/O error.
    pub fn bytes(&mut self, at: u64, count: usize) -> io::Result<&[u8]> {
        self.check(at, count)?;
        let end = at + count as u64;
        if at < self.read_at || end > self.read_at + self.read.len() as u64 {
            // A short request reads ahead, so that a record is read together with its header.
            let there = usize::try_from(self.len - at).unwrap_or(usize::MAX);
            self.read.resize(count.max(READ_BYTES).min(there), 0);
            self.is_at_end = false;
            let read = self.file.seek(SeekFrom::Start(at)).and_then(|_| self.file.read_exact(&mut self.read));
            if let Err(error) = read {
                self.read.clear();
                return Err(error);
            }
            self.read_at = at;
        }
        let first = (at - self.read_at) as usize;
        Ok(&self.read[first..first + count])
    }

    /// Maps a part of the file for reading it in order. All of it counts as memory of the process until it is dropped.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::UnexpectedEof`] beyond the end, or an error of the mapping.
    pub fn window(&self, at: u64, count: usize) -> io::Result<Window> {
        self.check(at, count)?;
        let mapping = (count > 0).then(|| map(&self.file, at, count)).transpose()?;
        Ok(Window { mapping })
    }

    fn check(&self, at: u64, count: usize) -> io::Result<()> {
        match at.checked_add(count as u64).is_some_and(|end| end <= self.len) {
            true => Ok(()),
            false => Err(io::ErrorKind::UnexpectedEof.into()),
        }
    }
}

impl Write for ScratchFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.append(bytes).map(|()| bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn appended_bytes_are_read_at_any_offset(
            parts in prop::collection::vec((0..9000_usize, any::<u8>()), 1..20),
            looks in prop::collection::vec((any::<u16>(), any::<u16>()), 1..30),
        ) {
            let mut file = ScratchFile::in_folder(&std::env::temp_dir()).unwrap();
            let mut all = Vec::new();
            for (length, first) in parts {
                let part: Vec<u8> = (0..length).map(|k| (k as u8).wrapping_add(first)).collect();
                file.append(&part).unwrap();
                all.extend(part);
                prop_assert_eq!(file.len(), all.len() as u64);
                for &(a, b) in &looks {
                    let (a, b) = (usize::from(a) % (all.len() + 1), usize::from(b) % (all.len() + 1));
                    let (at, count) = (a.min(b), a.abs_diff(b));
                    prop_assert_eq!(file.bytes(at as u64, count).unwrap(), &all[at..at + count]);
                    prop_assert_eq!(&*file.window(at as u64, count).unwrap(), &all[at..at + count]);
                }
                prop_assert!(file.bytes(file.len(), 1).is_err() && file.window(u64::MAX, 2).is_err());
            }
        }
    }

    #[test]
    fn a_window_outlives_its_file() {
        let mut file = ScratchFile::in_folder(&std::env::temp_dir()).unwrap();
        file.append(&[7; 10_000]).unwrap();
        let window = file.window(5000, 5000).unwrap();
        drop(file);
        assert_eq!(&*window, &[7; 5000]);
    }
}
