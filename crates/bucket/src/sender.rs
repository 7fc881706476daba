use super::bucket::Bucket;
use super::manifest::{PART_BYTES, StoredFile};
use super::object_name::ObjectName;
use super::pending::Pending;
use bytes::Bytes;
use rustc_hash::FxHashSet;
use std::collections::VecDeque;
use std::io::{self, Read};
use std::path::Path;
use voxtile::space::TileIndex;
use voxtile::{Error, Result};

/// Uploads the objects that a bucket lacks, several at a time.
pub(super) struct Sender<'a> {
    bucket: &'a Bucket,
    /// Objects that exist in the bucket or are being uploaded.
    known: FxHashSet<ObjectName>,
    in_flight: VecDeque<InFlight>,
    /// Whether to check for existing objects that no manifest names.
    checks_existing: bool,
    /// Number of objects that were checked in a row and did not exist.
    missing: usize,
    /// Tile of the next objects.
    tile: Option<TileIndex>,
    sent: Sent,
}

/// Counts of uploads.
#[derive(Default)]
pub(super) struct Sent {
    pub(super) objects: u64,
    pub(super) bytes: u64,
    /// Tiles with uploaded objects.
    pub(super) tiles: FxHashSet<TileIndex>,
}

struct InFlight {
    pending: Pending<bool>,
    bytes: u64,
    tile: Option<TileIndex>,
    was_checked: bool,
}

/// Maximum number of concurrent uploads. With parts of up to 16 MiB, they take up to 128 MiB of memory.
const MAX_IN_FLIGHT: usize = 8;

/// Number of checks in a row without an existing object after which small objects are uploaded without a check. An
/// interrupted push leaves objects in the order of upload, and a check takes as long as a small upload.
const MAX_MISSING: usize = 32;

/// Size in bytes from which objects are always checked.
const LARGE_BYTES: usize = 1 << 20;

impl<'a> Sender<'a> {
    /// `checks_existing` enables checks for existing objects, which an interrupted push may have left.
    pub(super) fn new(bucket: &'a Bucket, checks_existing: bool) -> Self {
        Self {
            bucket,
            known: FxHashSet::default(),
            in_flight: VecDeque::new(),
            checks_existing,
            missing: 0,
            tile: None,
            sent: Sent::default(),
        }
    }

    /// Sets the tile of the next objects.
    pub(super) fn set_tile(&mut self, tile: Option<TileIndex>) {
        self.tile = tile;
    }

    /// Adds objects that exist in the bucket.
    pub(super) fn add_existing<'b>(&mut self, files: impl Iterator<Item = &'b StoredFile>) {
        self.known.extend(files.flat_map(|file| &file.parts));
    }

    /// Uploads the missing parts of a file. `input` begins after the leading parts, which the bucket has. A read error
    /// names `path`.
    pub(super) fn send_file(
        &mut self,
        path: &Path,
        leading: Vec<ObjectName>,
        input: &mut impl Read,
    ) -> Result<StoredFile> {
        let bytes = leading.len() as u64 * PART_BYTES;
        let mut file = StoredFile { bytes, crc32: None, scan_number: None, parts: leading };
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

    /// Uploads an object if it is missing.
    pub(super) fn send(&mut self, content: Bytes) -> Result<ObjectName> {
        let name = ObjectName::of(&content);
        if self.known.insert(name) {
            self.wait_until(MAX_IN_FLIGHT - 1)?;
            let was_checked =
                self.checks_existing && (content.len() >= LARGE_BYTES || self.missing < MAX_MISSING);
            let bytes = content.len() as u64;
            let pending = self.bucket.put(name, content, was_checked);
            self.in_flight.push_back(InFlight { pending, bytes, tile: self.tile, was_checked });
        }
        Ok(name)
    }

    /// Waits for all uploads.
    pub(super) fn finish(&mut self) -> Result<()> {
        self.wait_until(0)
    }

    /// Returns the counts of uploads, complete after [`finish`](Self::finish).
    pub(super) fn sent(&self) -> &Sent {
        &self.sent
    }

    fn wait_until(&mut self, in_flight: usize) -> Result<()> {
        while self.in_flight.len() > in_flight
            && let Some(InFlight { pending, bytes, tile, was_checked }) = self.in_flight.pop_front()
        {
            let answer: io::Result<bool> = pending.wait();
            let is_sent = answer.map_err(|error| Error::io(self.bucket.path(), "write", error))?;
            if is_sent {
                self.missing += usize::from(was_checked);
                self.sent.objects += 1;
                self.sent.bytes += bytes;
                self.sent.tiles.extend(tile);
            } else {
                self.missing = 0;
            }
        }
        Ok(())
    }
}
