use super::bucket::missing_object;
use super::manifest::{PART_BYTES, StoredFile};
use super::object_name::ObjectName;
use super::part_cache::PartCache;
use bytes::{Buf, Bytes};
use std::io::{self, Read};
use std::sync::Arc;
use voxtile::store::DiskRead;

/// Reader of a file in a bucket, part by part. While a part is read, the next part is fetched.
pub(super) struct PartReader {
    parts: Arc<PartCache>,
    /// Whether other readers may need the same parts.
    keeps: bool,
    file: StoredFile,
    /// Number of the next part.
    next: usize,
    /// Rest of the current part.
    part: Bytes,
}

impl PartReader {
    /// Starts at an offset.
    pub(super) fn new(parts: Arc<PartCache>, file: StoredFile, offset: u64, keeps: bool) -> io::Result<Self> {
        let next = usize::try_from(offset / PART_BYTES).unwrap_or(usize::MAX);
        let mut reader = Self { parts, keeps, file, next, part: Bytes::new() };
        reader.request_next();
        let mut before = offset % PART_BYTES;
        while before > 0 && reader.take_part()? {
            let passed = before.min(reader.part.len() as u64);
            reader.part.advance(passed as usize);
            before -= passed;
        }
        Ok(reader)
    }

    /// Returns the next part and its size in bytes, if there is one.
    fn next_part(&self) -> Option<(ObjectName, u64)> {
        self.file.parts.get(self.next).map(|name| (*name, self.file.bytes_of_part(self.next)))
    }

    fn request_next(&self) {
        if let Some((name, bytes)) = self.next_part() {
            self.parts.request(name, bytes);
        }
    }

    /// Waits for the next part. Returns `false` at the end of the file.
    fn take_part(&mut self) -> io::Result<bool> {
        let Some((name, wanted)) = self.next_part() else { return Ok(false) };
        self.part = self.parts.get(name, self.keeps).map_err(missing_object)?;
        if self.part.len() as u64 != wanted {
            let reason = format!("object {}: {} bytes instead of {wanted}", name.key(), self.part.len());
            return Err(io::Error::new(io::ErrorKind::InvalidData, reason));
        }
        self.next += 1;
        self.request_next();
        Ok(true)
    }
}

impl Read for PartReader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.part.is_empty() && (buffer.is_empty() || !self.take_part()?) {
            return Ok(0);
        }
        let bytes = buffer.len().min(self.part.len());
        self.part.copy_to_slice(&mut buffer[..bytes]);
        Ok(bytes)
    }
}

impl DiskRead for PartReader {
    fn file_bytes(&self) -> u64 {
        self.file.bytes
    }
}
