use super::budget::Budget;
use super::bytes::Bytes;
use super::file_part::FilePart;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use voxtile::Result;

/// Temporary file for data that exceeds the memory of a reader. Its space is reused as soon as no part of it is in use.
/// If parts are in use at all times and the file grows too large, a new file replaces it; the old one is freed with its
/// last part.
#[derive(Debug)]
pub(crate) struct SpillFile {
    budget: Budget,
    file: Option<Arc<Mutex<File>>>,
    end: u64,
    /// File size at which a new file is started.
    max_bytes: u64,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum StreamSize {
    /// Size stated by the file. A longer stream is an error.
    Claimed(u64),
    /// Unknown size with an upper limit. A longer stream is an error.
    AtMost(u64),
}

impl StreamSize {
    fn most(self) -> u64 {
        match self {
            Self::Claimed(bytes) | Self::AtMost(bytes) => bytes,
        }
    }

    fn word(self) -> &'static str {
        match self {
            Self::Claimed(_) => "claims",
            Self::AtMost(_) => "may have",
        }
    }
}

/// Reason why a stream is incomplete.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Complaint {
    pub(crate) reason: String,
    /// Whether the decoder failed. The bytes before may then be wrong too, because many checksums follow their data.
    pub(crate) is_broken: bool,
}

const MAX_FILE_BYTES: u64 = 256 << 20;
/// Size of copy operations.
const COPY_BYTES: usize = 1 << 16;

impl SpillFile {
    pub(crate) fn new(budget: &Budget) -> Self {
        Self { budget: budget.clone(), file: None, end: 0, max_bytes: MAX_FILE_BYTES }
    }

    pub(crate) fn budget(&self) -> &Budget {
        &self.budget
    }

    /// Reads a stream to its end or to the limit of `size`: into memory up to `memory_bytes`, else into the file. `see`
    /// receives the bytes in order. Also returns the reason if the stream is incomplete.
    pub(crate) fn take(
        &mut self,
        mut input: impl Read,
        size: StreamSize,
        memory_bytes: usize,
        see: &mut dyn FnMut(&[u8]),
    ) -> Result<(Bytes, Option<Complaint>)> {
        let (mut start, mut complaint) = (Vec::new(), None);
        let broken = |error: std::io::Error| Complaint { reason: error.to_string(), is_broken: true };
        let (max_bytes, limit) = (size.most(), size.most().saturating_add(1));
        let reason = format!("it contains more than the {max_bytes} bytes that it {}", size.word());
        let too_many = Complaint { reason, is_broken: false };
        // Streams with a larger stated size go directly to the file.
        let first_bytes = match size {
            StreamSize::Claimed(claimed) if claimed >= memory_bytes as u64 => 0,
            _ => limit.min(memory_bytes as u64),
        };
        if first_bytes > 0 {
            if let StreamSize::Claimed(_) = size {
                // At most `memory_bytes`.
                start.reserve_exact(usize::try_from(first_bytes).unwrap_or(0));
            }
            let read = (&mut input).take(first_bytes).read_to_end(&mut start);
            complaint = read.err().map(broken);
            let is_too_long = start.len() as u64 == limit;
            start.truncate(usize::try_from(max_bytes).unwrap_or(usize::MAX));
            see(&start);
            if complaint.is_some() || is_too_long || (start.len() as u64) < first_bytes {
                return Ok((Bytes::Memory(start), complaint.or(is_too_long.then_some(too_many))));
            }
        }
        let cannot = |error| self.budget.cannot("write", error);
        let file = match self.file.take() {
            Some(file) if self.end < self.max_bytes || Arc::strong_count(&file) == 1 => file,
            _ => Arc::new(Mutex::new(self.budget.file()?)),
        };
        if Arc::strong_count(&file) == 1 {
            self.end = 0;
        }
        let begin = self.end;
        {
            let mut out = file.lock().unwrap_or_else(PoisonError::into_inner);
            if begin == 0 {
                out.set_len(0).map_err(cannot)?;
            }
            out.seek(SeekFrom::Start(begin)).map_err(cannot)?;
            out.write_all(&start).map_err(cannot)?;
            let mut written = start.len() as u64;
            drop(std::mem::take(&mut start));
            let mut buffer = vec![0; COPY_BYTES];
            while complaint.is_none() {
                match input.read(&mut buffer) {
                    Ok(0) => break,
                    Ok(count) => {
                        let left = usize::try_from(max_bytes - written).unwrap_or(usize::MAX);
                        if count > left {
                            complaint = Some(too_many.clone());
                        }
                        let bytes = buffer.get(..count.min(left)).unwrap_or_default();
                        see(bytes);
                        out.write_all(bytes).map_err(cannot)?;
                        written += bytes.len() as u64;
                    }
                    Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                    Err(error) => complaint = Some(broken(error)),
                }
            }
            self.end = begin + written;
        }
        let folder = self.budget.scratch.clone().unwrap_or_else(std::env::temp_dir);
        let part = FilePart::new(Arc::clone(&file), Arc::<Path>::from(folder), begin, self.end - begin);
        self.file = Some(file);
        Ok((Bytes::File(part), complaint))
    }
}

#[cfg(all(test, feature = "ros"))]
mod tests {
    use super::*;

    #[test]
    fn parts_that_always_overlap_take_several_files() {
        let mut spill = SpillFile { max_bytes: 1000, ..SpillFile::new(&Budget::default()) };
        let mut held = Vec::new();
        for k in 0..100_u8 {
            let size = StreamSize::Claimed(100);
            let (bytes, complaint) = spill.take(&[k; 100][..], size, 0, &mut |_| {}).unwrap();
            assert_eq!(complaint, None);
            held.push((k, bytes));
            if held.len() > 3 {
                held.remove(0);
            }
            assert!(spill.end <= 1000, "{}", spill.end);
            for (k, bytes) in &held {
                assert_eq!(bytes.piece(0, 100, &mut Default::default()).unwrap(), Some(&[*k; 100][..]));
            }
        }
    }
}
