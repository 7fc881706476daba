use super::bucket::{Bucket, missing_object};
use super::manifest::{PART_BYTES, StoredFile};
use super::pending::Pending;
use bytes::{Buf, Bytes};
use std::io::{self, Read};
use voxtile::store::DiskRead;

/// Reader of a file in a bucket, part by part. While a part is read, the next part is fetched.
pub(super) struct PartReader {
    bucket: Bucket,
    file: StoredFile,
    /// Number of the next part to request.
    next: usize,
    pending: Option<Pending<Bytes>>,
    /// Rest of the current part.
    part: Bytes,
}

impl PartReader {
    /// Starts at an offset. `first` is the pending request for the first part, if it was already sent.
    pub(super) fn new(
        bucket: Bucket,
        file: StoredFile,
        offset: u64,
        first: Option<Pending<Bytes>>,
    ) -> io::Result<Self> {
        let next = usize::try_from(offset / PART_BYTES).unwrap_or(usize::MAX);
        let mut reader = Self { bucket, file, next, pending: None, part: Bytes::new() };
        match first {
            Some(first) => (reader.pending, reader.next) = (Some(first), next.saturating_add(1)),
            None => reader.request_next(),
        }
        let mut before = offset % PART_BYTES;
        while before > 0 && reader.take_part()? {
            let passed = before.min(reader.part.len() as u64);
            reader.part.advance(passed as usize);
            before -= passed;
        }
        Ok(reader)
    }

    /// Requests the next part, if there is one.
    fn request_next(&mut self) {
        let name = self.file.parts.get(self.next).copied();
        self.pending = name.map(|name| self.bucket.fetch(name, PART_BYTES));
        self.next = self.next.saturating_add(1);
    }

    /// Waits for the requested part. Returns `false` at the end of the file.
    fn take_part(&mut self) -> io::Result<bool> {
        let (number, Some(pending)) = (self.next - 1, self.pending.take()) else { return Ok(false) };
        self.part = pending.wait().map_err(missing_object)?;
        let wanted = (self.file.bytes - number as u64 * PART_BYTES).min(PART_BYTES);
        if self.part.len() as u64 != wanted {
            let (found, name) = (self.part.len(), self.file.parts.get(number).map(|name| name.key()));
            let reason = format!("object {}: {found} bytes instead of {wanted}", name.unwrap_or_default());
            return Err(io::Error::new(io::ErrorKind::InvalidData, reason));
        }
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
