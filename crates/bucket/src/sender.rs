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

/// Sends objects that a bucket lacks, several at a time.
pub(super) struct Sender<'a> {
    bucket: &'a Bucket,
    /// Objects that are there, or on their way.
    known: FxHashSet<ObjectName>,
    in_flight: VecDeque<OnItsWay>,
    /// Whether the bucket may have objects that no manifest names.
    asks: bool,
    /// Objects in a row that were asked for and not there.
    missing: usize,
    /// The tile whose objects come next.
    tile: Option<TileIndex>,
    sent: Sent,
}

/// What was sent, beside what was there.
#[derive(Default)]
pub(super) struct Sent {
    pub(super) objects: u64,
    pub(super) bytes: u64,
    /// Tiles of which something was sent.
    pub(super) tiles: FxHashSet<TileIndex>,
}

struct OnItsWay {
    pending: Pending<bool>,
    bytes: u64,
    tile: Option<TileIndex>,
    was_asked_for: bool,
}

/// Parts on their way at a time: with 16 MiB a part at most, 128 MiB of memory.
const MAX_IN_FLIGHT: usize = 8;

/// A push that was interrupted has left objects behind, in the order in which they are sent again. After so many that
/// are not there, small ones are sent without a question: it takes as long as they do.
const MAX_MISSING: usize = 32;

/// Objects from here on are always asked for.
const LARGE_BYTES: usize = 1 << 20;

impl<'a> Sender<'a> {
    /// `asks` for objects before it sends them: they may have been left by a push that was interrupted.
    pub(super) fn new(bucket: &'a Bucket, asks: bool) -> Self {
        Self {
            bucket,
            known: FxHashSet::default(),
            in_flight: VecDeque::new(),
            asks,
            missing: 0,
            tile: None,
            sent: Sent::default(),
        }
    }

    /// What comes next is of this tile.
    pub(super) fn begin(&mut self, tile: Option<TileIndex>) {
        self.tile = tile;
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
            self.wait_until(MAX_IN_FLIGHT - 1)?;
            let was_asked_for = self.asks && (content.len() >= LARGE_BYTES || self.missing < MAX_MISSING);
            let bytes = content.len() as u64;
            let pending = self.bucket.put(name, content, was_asked_for);
            self.in_flight.push_back(OnItsWay { pending, bytes, tile: self.tile, was_asked_for });
        }
        Ok(name)
    }

    /// Waits until everything is there.
    pub(super) fn finish(&mut self) -> Result<()> {
        self.wait_until(0)
    }

    /// What was sent until [`finish`](Self::finish).
    pub(super) fn sent(&self) -> &Sent {
        &self.sent
    }

    fn wait_until(&mut self, in_flight: usize) -> Result<()> {
        while self.in_flight.len() > in_flight
            && let Some(OnItsWay { pending, bytes, tile, was_asked_for }) = self.in_flight.pop_front()
        {
            let answer: io::Result<bool> = pending.wait();
            let is_sent = answer.map_err(|error| Error::io(self.bucket.path(), "write", error))?;
            if is_sent {
                self.missing += usize::from(was_asked_for);
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
