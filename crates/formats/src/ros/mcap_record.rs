use super::file_bytes::{Pieces, signed_ns};
use super::recording::TopicList;
use super::wire::Wire;
use crate::spill::Complaint;
use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::sync::Arc;

/// First and last bytes of an MCAP file.
pub(super) const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// Size of a record's type and length.
pub(super) const RECORD_HEAD_BYTES: u64 = 9;
/// Size of a message before its data: channel, sequence number, two times.
pub(super) const MESSAGE_HEAD_BYTES: u64 = 2 + 4 + 8 + 8;

/// Record types.
pub(super) mod op {
    pub(in crate::ros) const FOOTER: u8 = 2;
    pub(in crate::ros) const SCHEMA: u8 = 3;
    pub(in crate::ros) const CHANNEL: u8 = 4;
    pub(in crate::ros) const MESSAGE: u8 = 5;
    pub(in crate::ros) const CHUNK: u8 = 6;
    pub(in crate::ros) const CHUNK_INDEX: u8 = 8;
    pub(in crate::ros) const STATISTICS: u8 = 11;
    pub(in crate::ros) const DATA_END: u8 = 15;
}

/// Channels of a file, with their message types and topics.
#[derive(Debug, Default)]
pub(super) struct Channels {
    types: HashMap<u16, String>,
    /// Topics by channel. `None` for topics skipped because there are too many.
    topics: HashMap<u16, Option<usize>>,
}

/// Number of bytes to read of a schema or channel record, which starts with its names.
pub(super) const MAX_NAMES_BYTES: u64 = 1 << 14;

/// Returns the record at an offset: its type, the range of its contents and the next offset.
pub(super) fn record_at(bytes: &[u8], at: usize) -> Option<(u8, Range<usize>, usize)> {
    let mut pieces = Pieces { bytes, at };
    let (kind, count) = (pieces.u8()?, usize::try_from(pieces.u64()?).ok()?);
    let start = pieces.at;
    pieces.take(count)?;
    Some((kind, start..pieces.at, pieces.at))
}

impl Channels {
    pub(super) fn is_empty(&self) -> bool {
        self.topics.is_empty()
    }

    /// Returns the topic of a channel. The outer `None` means unknown, the inner one skipped.
    pub(super) fn topic(&self, channel: u16) -> Option<Option<usize>> {
        self.topics.get(&channel).copied()
    }

    /// Returns whether the ID of a schema or channel record is already known.
    pub(super) fn knows(&self, kind: u8, contents: &[u8]) -> bool {
        let id = Pieces::new(contents).u16();
        id.is_some_and(|id| match kind {
            op::SCHEMA => self.types.contains_key(&id),
            _ => self.topics.contains_key(&id),
        })
    }

    /// Adds a schema record.
    pub(super) fn add_schema(&mut self, contents: &[u8]) -> Option<()> {
        let mut pieces = Pieces::new(contents);
        let id = pieces.u16()?;
        self.types.insert(id, pieces.name()?);
        Some(())
    }

    /// Adds a channel record.
    pub(super) fn add_channel(&mut self, contents: &[u8], topics: &mut TopicList) -> Option<()> {
        let mut pieces = Pieces::new(contents);
        let (id, schema) = (pieces.u16()?, pieces.u16()?);
        let (name, encoding) = (pieces.name()?, pieces.name()?);
        let wire = match encoding.as_str() {
            "ros1" => Some(Wire::Ros1),
            "cdr" => Some(Wire::Cdr),
            _ => None,
        };
        let type_name = self.types.get(&schema).map_or("", String::as_str);
        self.topics.insert(id, topics.index(&name, type_name, wire));
        Some(())
    }
}

/// Parses the start of a message: its channel and recording time.
pub(super) fn message_head(contents: &[u8]) -> Option<(u16, i64)> {
    let mut pieces = Pieces::new(contents);
    let channel = pieces.u16()?;
    pieces.u32()?;
    let log_ns = signed_ns(pieces.u64()?);
    pieces.u64()?;
    Some((channel, log_ns))
}

/// Header of a chunk.
pub(super) struct ChunkHead {
    pub(super) plain_bytes: u64,
    /// Checksum of the uncompressed records, or 0 if the recorder wrote none.
    pub(super) crc: u32,
    pub(super) compression: String,
    /// Offset of the compressed records in the chunk, and their size.
    pub(super) records_at: u64,
    pub(super) records_bytes: u64,
}

impl ChunkHead {
    /// Upper bound for the size of the header.
    pub(super) const MAX_BYTES: u64 = 1 << 13;

    pub(super) fn of(contents: &[u8]) -> Option<Self> {
        let mut pieces = Pieces::new(contents);
        pieces.take(16)?;
        let plain_bytes = pieces.u64()?;
        let crc = pieces.u32()?;
        let compression = pieces.name()?;
        let records_bytes = pieces.u64()?;
        Some(Self { plain_bytes, crc, compression, records_at: pieces.at as u64, records_bytes })
    }

    /// Returns a complaint if the checksum of the uncompressed records is wrong.
    pub(super) fn complaint(&self, plain: crc32fast::Hasher) -> Option<Complaint> {
        let (found, wanted) = (plain.finalize(), self.crc);
        let reason = || {
            format!(
                "its contents are damaged: their checksum is {found:08x}, but its header states {wanted:08x}"
            )
        };
        (wanted != 0 && found != wanted).then(|| Complaint { reason: reason(), is_broken: true })
    }
}

/// Location of a chunk.
pub(super) struct ChunkIndex {
    pub(super) start_ns: i64,
    pub(super) offset: u64,
    pub(super) bytes: u64,
    /// Channels with messages in the chunk. Empty if unknown.
    pub(super) channels: Arc<[u16]>,
}

impl ChunkIndex {
    /// Replaces the channel list by an equal one from `lists`, to share memory.
    pub(super) fn shared(self, lists: &mut HashSet<Arc<[u16]>>) -> Self {
        match lists.get(&self.channels) {
            Some(list) => Self { channels: Arc::clone(list), ..self },
            None => {
                lists.insert(Arc::clone(&self.channels));
                self
            }
        }
    }

    pub(super) fn of(contents: &[u8]) -> Option<Self> {
        let mut pieces = Pieces::new(contents);
        let start_ns = signed_ns(pieces.u64()?);
        pieces.u64()?;
        let (offset, bytes) = (pieces.u64()?, pieces.u64()?);
        let map = pieces.sized()?;
        let channels = map.chunks_exact(10).filter_map(|entry| Pieces::new(entry).u16()).collect();
        Some(Self { start_ns, offset, bytes, channels })
    }
}

/// Message counts by channel.
pub(super) struct Statistics {
    pub(super) messages: u64,
    pub(super) chunks: u32,
    pub(super) channels: Vec<(u16, u64)>,
}

impl Statistics {
    pub(super) fn of(contents: &[u8]) -> Option<Self> {
        let mut pieces = Pieces::new(contents);
        let messages = pieces.u64()?;
        // Skip the numbers of schemas, channels, attachments and metadata records.
        pieces.take(2 + 4 + 4 + 4)?;
        let chunks = pieces.u32()?;
        pieces.take(16)?;
        let map = pieces.sized()?;
        let channels = map.chunks_exact(10).filter_map(|entry| {
            let mut pieces = Pieces::new(entry);
            Some((pieces.u16()?, pieces.u64()?))
        });
        Some(Self { messages, chunks, channels: channels.collect() })
    }
}
