use super::bucket::{Bucket, Pending};
use super::manifest::{PART_BYTES, StoredFile};
use super::object_name::ObjectName;
use crate::error::{Error, Result};
use bytes::Bytes;
use rustc_hash::FxHashSet;
use std::collections::VecDeque;
use std::io::{self, Read};
use std::path::Path;

/// Sends objects that a bucket lacks, several at a time.
pub(super) struct Sender<'a> {
    bucket: &'a Bucket,
    /// Objects that are there, or on their way.
    known: FxHashSet<ObjectName>,
    in_flight: VecDeque<Pending<()>>,
    /// Objects that were sent, and their bytes.
    pub(super) objects: u64,
    pub(super) bytes: u64,
}

/// Parts on their way at a time: with 16 MiB a part at most, 128 MiB of memory.
const MOST_IN_FLIGHT: usize = 8;

impl<'a> Sender<'a> {
    pub(super) fn new(bucket: &'a Bucket) -> Self {
        Self { bucket, known: FxHashSet::default(), in_flight: VecDeque::new(), objects: 0, bytes: 0 }
    }

    /// Notes objects that are there.
    pub(super) fn note<'b>(&mut self, files: impl Iterator<Item = &'b StoredFile>) {
        self.known.extend(files.flat_map(|file| &file.parts));
    }

    /// Sends the parts of a file that are not there; an error of reading names `path`.
    pub(super) fn send_file(&mut self, path: &Path, input: &mut impl Read) -> Result<StoredFile> {
        let mut file = StoredFile { bytes: 0, crc32: None, scan_number: None, parts: Vec::new() };
        loop {
            let mut part = Vec::new();
            let read = input.by_ref().take(PART_BYTES).read_to_end(&mut part);
            read.map_err(|error| Error::io(path, "read", error))?;
            if part.is_empty() {
                return Ok(file);
            }
            file.bytes += part.len() as u64;
            file.parts.push(self.send(part.into())?);
        }
    }

    /// Sends an object, if it is not there.
    pub(super) fn send(&mut self, content: Bytes) -> Result<ObjectName> {
        let name = ObjectName::of(&content);
        if self.known.insert(name) {
            self.wait_until(MOST_IN_FLIGHT - 1)?;
            self.objects += 1;
            self.bytes += content.len() as u64;
            self.in_flight.push_back(self.bucket.put(name, content));
        }
        Ok(name)
    }

    /// Waits until everything is there.
    pub(super) fn finish(&mut self) -> Result<()> {
        self.wait_until(0)
    }

    fn wait_until(&mut self, in_flight: usize) -> Result<()> {
        while self.in_flight.len() > in_flight
            && let Some(pending) = self.in_flight.pop_front()
        {
            let sent: io::Result<()> = pending.wait();
            sent.map_err(|error| Error::io(self.bucket.path(), "write", error))?;
        }
        Ok(())
    }
}
