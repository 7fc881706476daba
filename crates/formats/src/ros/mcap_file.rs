use super::chunk::{ChunkPlace, MAX_CHUNK_BYTES, MessagePlace, OpenChunk, decompress, plain};
use super::chunk_file::{ChunkFile, Shares, TakeMessage, Walk, check_chunks};
use super::chunk_order::{ChunkOrder, Step};
use super::file_bytes::{FileBytes, Pieces, cut_at};
use super::mcap_record::{
    Channels, ChunkHead, ChunkIndex, MAGIC, MAX_NAMES_BYTES, MESSAGE_HEAD_BYTES, RECORD_HEAD_BYTES,
    Statistics, message_head, op, record_at,
};
use super::recording::{Message, Recording, Topic, TopicList};
use crate::spill::{Budget, Complaint, SpillFile, StreamSize, Window};
use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;
use voxtile::{FormatError, Result};

/// MCAP file of ROS 1 or ROS 2. If it has no summary, the file is read twice.
///
/// Messages are returned in order of their recording time. Chunks that overlap in time are in memory or, beyond its
/// share, in a temporary file.
#[derive(Debug)]
pub struct McapFile {
    file: FileBytes,
    topics: TopicList,
    channels: Channels,
    chunks: Vec<ChunkPlace>,
    order: ChunkOrder,
    spill: SpillFile,
    remarks: Vec<String>,
}

/// Size of the footer and the magic bytes at the end.
const END_BYTES: u64 = RECORD_HEAD_BYTES + 20 + 8;
/// Size of the magic bytes at the end.
const END_MAGIC_BYTES: u64 = 8;
/// Limit for a record of the summary.
const MAX_RECORD_BYTES: u64 = 1 << 20;
/// Limit for consecutive messages outside of chunks that are read together.
const BARE_CHUNK_BYTES: u64 = 4 << 20;
/// Maximum number of topics to record for a group of such messages. A group with more topics is always read.
const MAX_BARE_TOPICS: usize = 64;

impl McapFile {
    /// Opens a file.
    ///
    /// # Errors
    ///
    /// The file cannot be read or is not MCAP.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_within(path, &Budget::default())
    }

    /// As [`McapFile::open`], within a memory budget.
    ///
    /// # Errors
    ///
    /// As for [`McapFile::open`].
    pub fn open_within(path: &Path, budget: &Budget) -> Result<Self> {
        let mut file = FileBytes::open(path)?;
        if file.read_at(0, MAGIC.len() as u64)? != MAGIC {
            return Err(FormatError::at_offset(
                0,
                "it does not start with the signature of an MCAP file (version 0)",
            )
            .in_input(path));
        }
        let mut mcap = Self {
            file,
            topics: TopicList::default(),
            channels: Channels::default(),
            chunks: Vec::new(),
            order: ChunkOrder::new(budget),
            spill: SpillFile::new(budget),
            remarks: Vec::new(),
        };
        if !mcap.read_summary()? {
            mcap.topics = TopicList::default();
            mcap.channels = Channels::default();
            mcap.chunks.clear();
            mcap.scan()?;
        }
        Ok(mcap)
    }

    /// Returns the type and the length of the record at an offset, or `None` at the end of the file.
    fn head(&mut self, offset: u64) -> Result<Option<(u8, u64)>> {
        let head = self.file.read_at(offset, RECORD_HEAD_BYTES)?;
        let mut pieces = Pieces::new(&head);
        Ok(pieces.u8().zip(pieces.u64()))
    }

    /// Reads channels and chunk locations from the end of the file. Returns `false` if they are incomplete.
    fn read_summary(&mut self) -> Result<bool> {
        let Some(end_at) = self.file.len.checked_sub(END_BYTES) else { return Ok(false) };
        let end = self.file.read_at(end_at, END_BYTES)?;
        let footer = record_at(&end, 0).filter(|(kind, ..)| *kind == op::FOOTER && end.ends_with(MAGIC));
        let footer = footer.and_then(|(_, contents, _)| Pieces::new(end.get(contents)?).u64());
        let Some(mut at) = footer.filter(|&start| start != 0) else { return Ok(false) };
        let shares = Shares::of(self.spill.budget());
        let mut statistics = None;
        // Channel records may follow the chunk indexes, so the lists contain channel IDs until all records are read.
        let mut lists = HashSet::new();
        let mut indices = Vec::new();
        while at < end_at {
            let Some((kind, bytes)) = self.head(at)? else { return Ok(false) };
            let next = at.checked_add(RECORD_HEAD_BYTES).and_then(|at| at.checked_add(bytes));
            let Some(next) = next.filter(|&next| next <= end_at) else { return Ok(false) };
            if matches!(kind, op::SCHEMA | op::CHANNEL | op::CHUNK_INDEX | op::STATISTICS) {
                let max_bytes = match kind {
                    op::SCHEMA | op::CHANNEL => bytes.min(MAX_NAMES_BYTES),
                    _ if bytes > MAX_RECORD_BYTES => return Ok(false),
                    _ => bytes,
                };
                let contents = self.file.read_at(at + RECORD_HEAD_BYTES, max_bytes)?;
                let taken = match kind {
                    op::SCHEMA => self.channels.add_schema(&contents),
                    op::CHANNEL => self.channels.add_channel(&contents, &mut self.topics),
                    op::CHUNK_INDEX => {
                        check_chunks(indices.len(), shares, self.file.path())?;
                        ChunkIndex::of(&contents).map(|index| indices.push(index.shared(&mut lists)))
                    }
                    _ => Statistics::of(&contents).map(|found| statistics = Some(found)),
                };
                if taken.is_none() {
                    return Ok(false);
                }
            }
            at = next;
        }
        let Some(statistics) = statistics else { return Ok(false) };
        // Without chunks or their indexes, messages are found by reading all records.
        if statistics.messages > 0
            && (self.channels.is_empty() || indices.len() as u64 != u64::from(statistics.chunks))
        {
            return Ok(false);
        }
        if statistics.messages > 0 && indices.is_empty() {
            return Ok(false);
        }
        for (channel, messages) in statistics.channels {
            if let Some(Some(topic)) = self.channels.topic(channel) {
                self.topics.count(topic, messages);
            }
        }
        let topics = lists.into_iter().map(|channels: Arc<[u16]>| {
            let topics = channels.iter().map(|&channel| self.channels.topic(channel));
            let topics: Option<Vec<Option<usize>>> =
                if channels.is_empty() { None } else { topics.collect() };
            let topics = topics.map(|topics| topics.into_iter().flatten().collect::<Arc<[usize]>>());
            (channels, topics)
        });
        let topics: HashMap<Arc<[u16]>, Option<Arc<[usize]>>> = topics.collect();
        for ChunkIndex { start_ns, offset, bytes, channels } in indices {
            let topics = topics.get(&channels).cloned().flatten();
            self.chunks.push(ChunkPlace { offset, bytes, start_ns, topics, is_bare: false });
        }
        Ok(true)
    }

    /// Reads all records, and inspects each chunk.
    fn scan(&mut self) -> Result<()> {
        let mut at = MAGIC.len() as u64;
        let shares = Shares::of(self.spill.budget());
        let (mut walk, mut is_ended, mut is_closed, mut cut) = (Walk::default(), false, false, String::new());
        while let Some((kind, bytes)) = self.head(at)? {
            if matches!(kind, op::DATA_END | op::FOOTER) {
                is_ended = true;
                is_closed =
                    self.file.read_at(self.file.len.saturating_sub(END_MAGIC_BYTES), END_MAGIC_BYTES)?
                        == MAGIC;
                break;
            }
            let Some(next) = at.checked_add(RECORD_HEAD_BYTES).and_then(|at| at.checked_add(bytes)) else {
                break;
            };
            if next > self.file.len {
                cut = cut_at(at, self.file.len, Some(next));
            }
            match kind {
                op::SCHEMA | op::CHANNEL => {
                    let contents = self.file.read_at(at + RECORD_HEAD_BYTES, bytes.min(MAX_NAMES_BYTES))?;
                    match kind {
                        op::SCHEMA => self.channels.add_schema(&contents),
                        _ => self.channels.add_channel(&contents, &mut self.topics),
                    };
                }
                op::CHUNK => self.look_into(at, next - at, &mut walk)?,
                op::MESSAGE if next <= self.file.len => {
                    let head = self.file.read_at(at + RECORD_HEAD_BYTES, MESSAGE_HEAD_BYTES.min(bytes))?;
                    let head = message_head(&head);
                    let known =
                        head.and_then(|(channel, log_ns)| Some((self.channels.topic(channel)??, log_ns)));
                    if let Some((topic, log_ns)) = known {
                        self.topics.count(topic, 1);
                        walk.messages += 1;
                        check_chunks(self.chunks.len(), shares, self.file.path())?;
                        self.append_bare(at, next, topic, log_ns);
                    }
                }
                _ => {}
            }
            at = next;
        }
        if !is_ended && at < self.file.len {
            cut = cut_at(at, self.file.len, None);
        }
        if !is_closed {
            let messages = walk.messages;
            self.remarks.push(format!(
                "{} has no footer (the recorder did not close it, or it was truncated{cut}): {messages} messages were \
                 found by reading the whole file",
                self.file.path().display()
            ));
        }
        Ok(())
    }

    /// Adds a message outside of chunks to the previous group of such messages.
    fn append_bare(&mut self, at: u64, next: u64, topic: usize, log_ns: i64) {
        match self.chunks.last_mut().filter(|place| place.is_bare && next - place.offset <= BARE_CHUNK_BYTES)
        {
            Some(place) => {
                place.bytes = next - place.offset;
                place.start_ns = place.start_ns.min(log_ns);
                let Some(topics) = place.topics.as_deref() else { return };
                if !topics.contains(&topic) {
                    let is_room = topics.len() < MAX_BARE_TOPICS;
                    place.topics = is_room.then(|| topics.iter().copied().chain([topic]).collect());
                }
            }
            None => {
                let (bytes, topics) = (next - at, Some(Arc::from([topic])));
                self.chunks.push(ChunkPlace { offset: at, bytes, start_ns: log_ns, topics, is_bare: true });
            }
        }
    }

    /// Visits the records of a chunk.
    fn find_messages(&mut self, chunk: &mut OpenChunk, take: &mut TakeMessage<'_>) -> Result<()> {
        let is_broken = chunk.is_broken();
        let OpenChunk { bytes, complaint } = chunk;
        let (mut window, mut at) = (Window::default(), 0);
        while at < bytes.len() {
            let head = bytes.piece(at, RECORD_HEAD_BYTES as usize, &mut window)?;
            let head = head.and_then(|head| {
                let mut pieces = Pieces::new(head);
                pieces.u8().zip(pieces.u64())
            });
            let start = at + RECORD_HEAD_BYTES;
            let whole = head.and_then(|(kind, count)| {
                let end = start.checked_add(count).filter(|end| *end <= bytes.len())?;
                Some((kind, count, end))
            });
            let Some((kind, count, end)) = whole else {
                OpenChunk::note(complaint, format!("there is no record at byte {at} of its contents"));
                return Ok(());
            };
            let max_bytes = match kind {
                op::SCHEMA | op::CHANNEL => MAX_NAMES_BYTES,
                op::MESSAGE => MESSAGE_HEAD_BYTES,
                _ => 0,
            };
            let contents =
                bytes.piece(start, count.min(max_bytes) as usize, &mut window)?.unwrap_or_default();
            match kind {
                // Records from a broken chunk may be wrong, so known channels are kept.
                op::SCHEMA | op::CHANNEL if is_broken && self.channels.knows(kind, contents) => {}
                op::SCHEMA => drop(self.channels.add_schema(contents)),
                op::CHANNEL => drop(self.channels.add_channel(contents, &mut self.topics)),
                op::MESSAGE => {
                    let head = message_head(contents);
                    let known =
                        head.and_then(|(channel, log_ns)| Some((self.channels.topic(channel)?, log_ns)));
                    let Some((topic, log_ns)) = known else {
                        OpenChunk::note(complaint, format!("byte {at}: the message has no channel"));
                        return Ok(());
                    };
                    let start = start + MESSAGE_HEAD_BYTES;
                    if let Some(topic) = topic {
                        take(MessagePlace { log_ns, start, len: end - start, topic })?;
                    }
                }
                _ => {}
            }
            at = end;
        }
        Ok(())
    }

    /// Returns the decompressed contents of a chunk.
    fn unpacked(&mut self, place: &ChunkPlace) -> Result<OpenChunk> {
        let path = self.file.path().to_owned();
        let wrong = |reason: &str| FormatError::at_offset(place.offset, reason).in_input(&path);
        let too_large =
            || wrong("chunks of more than 1 GiB are not supported: write smaller chunks (`mcap recover`)");
        let head = self.head(place.offset)?;
        let Some((_, bytes)) = head.filter(|(kind, _)| *kind == op::CHUNK) else {
            return Err(wrong(
                "there is no chunk at the place in the index: rebuild the index with `mcap recover`",
            ));
        };
        if bytes > MAX_CHUNK_BYTES {
            return Err(too_large());
        }
        let contents_at = place.offset.saturating_add(RECORD_HEAD_BYTES);
        let there = bytes.min(self.file.len.saturating_sub(contents_at));
        let start = self.file.read_at(contents_at, there.min(ChunkHead::MAX_BYTES))?;
        let head = ChunkHead::of(&start).ok_or_else(|| wrong("the header of a chunk is truncated"))?;
        if head.plain_bytes > MAX_CHUNK_BYTES {
            return Err(too_large());
        }
        let (records_at, room) = (contents_at + head.records_at, there.saturating_sub(head.records_at));
        let records_bytes = head.records_bytes.min(room);
        let is_cut = there < bytes || head.records_bytes > room;
        let memory_bytes = self.order.chunk_bytes();
        let mut crc = crc32fast::Hasher::new();
        let mut see = |bytes: &[u8]| {
            if head.crc != 0 {
                crc.update(bytes);
            }
        };
        let is_packed = !matches!(head.compression.as_str(), "" | "none");
        let (spill, part) = (&mut self.spill, self.file.whole()?.part(records_at, records_bytes));
        let (bytes, complaint) = self.file.stream(records_at, records_bytes, |input| match is_packed {
            true => {
                let size = StreamSize::Claimed(head.plain_bytes);
                decompress(&head.compression, input, size, spill, memory_bytes, &mut see)
            }
            false => plain(part, memory_bytes, input, &mut see),
        })?;
        if is_cut {
            // Report the truncation, which also explains a wrong checksum.
            let reason = "the file ends within it".to_owned();
            return Ok(OpenChunk { bytes, complaint: Some(Complaint { reason, is_broken: false }) });
        }
        let has_checksum = head.crc != 0;
        let wrong = head.complaint(crc);
        let is_broken = wrong.is_some();
        let complaint = complaint.map(|complaint| match has_checksum {
            true => Complaint { is_broken, ..complaint },
            false => complaint,
        });
        Ok(OpenChunk { bytes, complaint: complaint.or(wrong) })
    }
}

impl ChunkFile for McapFile {
    fn path(&self) -> &Path {
        self.file.path()
    }

    fn order(&mut self) -> &mut ChunkOrder {
        &mut self.order
    }

    fn step(&mut self) -> Result<Step> {
        self.order.step(&self.chunks)
    }

    fn found(&mut self) -> (&mut TopicList, &mut Vec<ChunkPlace>) {
        (&mut self.topics, &mut self.chunks)
    }

    fn load(&mut self, place: &ChunkPlace, take: &mut TakeMessage<'_>) -> Result<OpenChunk> {
        let mut chunk = if place.is_bare {
            let memory_bytes = self.order.chunk_bytes();
            let bytes = place.bytes.min(self.file.len.saturating_sub(place.offset));
            let part = self.file.whole()?.part(place.offset, bytes);
            let read =
                self.file.stream(place.offset, bytes, |input| plain(part, memory_bytes, input, &mut |_| {}));
            let (bytes, complaint) = read?;
            OpenChunk { bytes, complaint }
        } else {
            self.unpacked(place)?
        };
        self.find_messages(&mut chunk, take)?;
        Ok(chunk)
    }
}

impl Recording for McapFile {
    fn format(&self) -> &str {
        let is_ros_1 = self.topics.topics.iter().any(|topic| topic.wire == Some(super::wire::Wire::Ros1));
        if is_ros_1 { "ROS 1 recording (MCAP)" } else { "ROS 2 bag (MCAP)" }
    }

    fn topics(&self) -> &[Topic] {
        &self.topics.topics
    }

    fn begin(&mut self, topics: &[usize]) -> Result<()> {
        self.order.begin(&self.chunks, topics);
        Ok(())
    }

    fn next_message(&mut self) -> Result<Option<Message>> {
        self.next_in_order()
    }

    fn close_files(&mut self) {
        self.file.close();
    }

    fn remarks(&self) -> Vec<String> {
        self.remarks.iter().cloned().chain(self.order.remark(self.file.path())).collect()
    }
}
