use crate::spill::FilePart;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};

/// File with random access.
#[derive(Debug)]
pub(super) struct FileBytes {
    path: PathBuf,
    /// `None` while the file is closed.
    input: Option<Input>,
    /// The whole file with a handle of its own, from which parts are read; `None` until the first part is requested.
    whole: Option<FilePart>,
    pub(super) len: u64,
}

/// An open file with its current position.
#[derive(Debug)]
struct Input {
    bytes: BufReader<File>,
    at: u64,
}

impl FileBytes {
    pub(super) fn open(path: &Path) -> Result<Self> {
        let open = || {
            let input = Input::open(path)?;
            let len = input.bytes.get_ref().metadata()?.len();
            Ok((input, len))
        };
        let (input, len) = open().map_err(|error| Error::io(path, "read", error))?;
        Ok(Self { path: path.to_owned(), input: Some(input), whole: None, len })
    }

    /// Closes the file until the next read.
    pub(super) fn close(&mut self) {
        (self.input, self.whole) = (None, None);
    }

    /// Returns the whole file as a part. All parts share one handle.
    pub(super) fn whole(&mut self) -> Result<FilePart> {
        let whole = match self.whole.take() {
            Some(whole) => whole,
            None => FilePart::open(&self.path, 0, self.len)?,
        };
        Ok(self.whole.insert(whole).clone())
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Reads a range of the file as a stream, which is shorter at the end of the file.
    pub(super) fn stream<T>(
        &mut self,
        offset: u64,
        bytes: u64,
        read: impl FnOnce(&mut dyn Read) -> Result<T>,
    ) -> Result<T> {
        let fail = |error| Error::io(&self.path, "read", error);
        let mut input = match self.input.take() {
            Some(input) => input,
            None => Input::open(&self.path).map_err(fail)?,
        };
        input.go_to(offset).map_err(fail)?;
        let mut stream = (&mut input.bytes).take(bytes);
        let outcome = read(&mut stream)?;
        input.at = offset.saturating_add(bytes - stream.limit());
        self.input = Some(input);
        Ok(outcome)
    }

    /// Reads a range of the file, which is shorter at the end of the file. Memory is only allocated for bytes that
    /// exist.
    pub(super) fn read_at(&mut self, offset: u64, bytes: u64) -> Result<Vec<u8>> {
        let there = bytes.min(self.len.saturating_sub(offset));
        if there == 0 {
            return Ok(Vec::new());
        }
        let input = self.input.take().map_or_else(|| Input::open(&self.path), Ok);
        // After an error, the position is unknown and the file is opened again.
        let read = input.and_then(|mut input| Ok((input.read_at(offset, there)?, input)));
        let (taken, input) = read.map_err(|error| Error::io(&self.path, "read", error))?;
        self.input = Some(input);
        Ok(taken)
    }
}

impl Input {
    fn open(path: &Path) -> io::Result<Self> {
        Ok(Self { bytes: BufReader::with_capacity(1 << 16, File::open(path)?), at: 0 })
    }

    fn go_to(&mut self, offset: u64) -> io::Result<()> {
        match i64::try_from(i128::from(offset) - i128::from(self.at)) {
            // A relative seek preserves the buffer.
            Ok(ahead) => self.bytes.seek_relative(ahead)?,
            Err(_) => drop(self.bytes.seek(SeekFrom::Start(offset))?),
        }
        self.at = offset;
        Ok(())
    }

    fn read_at(&mut self, offset: u64, bytes: u64) -> io::Result<Vec<u8>> {
        self.go_to(offset)?;
        let mut taken = Vec::new();
        (&mut self.bytes).take(bytes).read_to_end(&mut taken)?;
        self.at = offset.saturating_add(taken.len() as u64);
        Ok(taken)
    }
}

/// Describes where a record is truncated, as the end of a remark.
pub(super) fn cut_at(at: u64, file_bytes: u64, end: Option<u64>) -> String {
    match end {
        Some(end) => format!(" at byte {file_bytes}: the record at byte {at} should end at byte {end}"),
        None => format!(" at byte {file_bytes}, in the record at byte {at}"),
    }
}

/// Limit for the names of topics, types and encodings.
const MAX_NAME_BYTES: usize = 1 << 12;

/// Reader of little-endian numbers and slices of a record.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pieces<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
}

impl<'a> Pieces<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    pub(super) fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let end = self.at.checked_add(count)?;
        let taken = self.bytes.get(self.at..end)?;
        self.at = end;
        Some(taken)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.at >= self.bytes.len()
    }

    pub(super) fn u8(&mut self) -> Option<u8> {
        self.take(1)?.first().copied()
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(*self.take(2)?.first_chunk()?))
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(*self.take(4)?.first_chunk()?))
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(*self.take(8)?.first_chunk()?))
    }

    /// Reads length-prefixed bytes.
    pub(super) fn sized(&mut self) -> Option<&'a [u8]> {
        let count = self.u32()? as usize;
        self.take(count)
    }

    /// Reads a length-prefixed name.
    pub(super) fn name(&mut self) -> Option<String> {
        let name = self.sized().filter(|name| name.len() <= MAX_NAME_BYTES)?;
        Some(String::from_utf8_lossy(name).into_owned())
    }
}

/// Converts nanoseconds to a signed number, saturating.
pub(super) fn signed_ns(ns: u64) -> i64 {
    i64::try_from(ns).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_file_share_one_handle() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), b"0123456789").unwrap();
        let mut bytes = FileBytes::open(file.path()).unwrap();
        let parts: Vec<FilePart> = (0..10).map(|k| bytes.whole().unwrap().part(k, 1)).collect();
        for (part, wanted) in parts.iter().zip(b"0123456789") {
            let mut found = [0];
            part.read_at(0, &mut found).unwrap();
            assert_eq!(&found, &[*wanted]);
        }
        let whole = bytes.whole().unwrap();
        assert!(parts.iter().all(|part| part.has_handle_of(&whole)));
        bytes.close();
        assert!(!bytes.whole().unwrap().has_handle_of(&whole));
    }
}
