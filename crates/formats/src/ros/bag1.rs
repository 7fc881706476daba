use super::bag1_record::{Record, RecordKind};
use super::chunk::{ChunkPlace, MAX_CHUNK_BYTES, MessagePlace, OpenChunk, decompress, plain};
use super::chunk_file::{ChunkFile, Shares, TakeMessage, Walk, check_chunks};
use super::chunk_order::{ChunkOrder, Step};
use super::file_bytes::{FileBytes, cut_at};
use super::recording::{Message, Recording, Topic, TopicList};
use super::wire::Wire;
use crate::spill::{Budget, Complaint, SpillFile, StreamSize, Window};
use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;
use voxtile::{FormatError, Result};

/// ROS 1 bag file (`.bag`, version 2.0). If it has no index, the file is read twice.
#[derive(Debug)]
pub struct Bag1 {
    file: FileBytes,
    topics: TopicList,
    /// Topics by connection ID. `None` for connections skipped because there are too many topics.
    connections: HashMap<u32, Option<usize>>,
    chunks: Vec<ChunkPlace>,
    order: ChunkOrder,
    spill: SpillFile,
    remarks: Vec<String>,
}

const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// Limit for a record header.
const MAX_HEADER_BYTES: u64 = 1 << 16;
/// Limit for connection records, which contain message definitions, and for chunk info records.
const MAX_RECORD_BYTES: u64 = 4 << 20;
/// Limit for connections (publishers of topics). Further ones are skipped.
const MAX_CONNECTIONS: usize = 1 << 16;

impl Bag1 {
    /// Opens a bag.
    ///
    /// # Errors
    ///
    /// The file cannot be read or is not such a bag.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_within(path, &Budget::default())
    }

    /// As [`Bag1::open`], within a memory budget.
    ///
    /// # Errors
    ///
    /// As for [`Bag1::open`].
    pub fn open_within(path: &Path, budget: &Budget) -> Result<Self> {
        let mut file = FileBytes::open(path)?;
        let magic = file.read_at(0, MAGIC.len() as u64)?;
        if magic != MAGIC {
            let reason = if magic.starts_with(b"#ROSBAG V1") {
                "bag format version 1 is not supported: convert it to version 2.0 with `rosbag fix` or `rosbag \
                 reindex`"
            } else {
                "it does not start with `#ROSBAG V2.0`: it is not a ROS 1 bag"
            };
            return Err(FormatError::at_offset(0, reason).in_input(path));
        }
        let mut bag = Self {
            file,
            topics: TopicList::default(),
            connections: HashMap::new(),
            chunks: Vec::new(),
            order: ChunkOrder::new(budget),
            spill: SpillFile::new(budget),
            remarks: Vec::new(),
        };
        let first = bag.record(MAGIC.len() as u64)?;
        let index_at = first.filter(|(record, _)| record.op == Some(RecordKind::BagHeader));
        let index_at = index_at.and_then(|(record, _)| record.u64("index_pos")).unwrap_or(0);
        if index_at == 0 || !bag.read_index(index_at)? {
            bag.scan()?;
        }
        Ok(bag)
    }

    /// Reads the record at an offset and returns it with the offset of the next one. The data of chunks and index
    /// records is not read. `None` if there is no complete header.
    fn record(&mut self, offset: u64) -> Result<Option<(Record, u64)>> {
        let start = self.file.read_at(offset, 4)?;
        let Some(header_bytes) = start.first_chunk().map(|bytes| u64::from(u32::from_le_bytes(*bytes)))
        else {
            return Ok(None);
        };
        let header = self.file.read_at(offset + 4, (header_bytes + 4).min(MAX_HEADER_BYTES))?;
        let Some((fields, data_bytes)) =
            header.split_last_chunk().filter(|_| header.len() as u64 == header_bytes + 4)
        else {
            return Ok(None);
        };
        let data_bytes = u64::from(u32::from_le_bytes(*data_bytes));
        let data_at = offset + 8 + header_bytes;
        let Some(mut record) = Record::of(fields) else { return Ok(None) };
        if matches!(record.op, Some(RecordKind::Connection | RecordKind::ChunkInfo)) {
            if data_bytes > MAX_RECORD_BYTES {
                return Ok(None);
            }
            record.data = self.file.read_at(data_at, data_bytes)?;
            if (record.data.len() as u64) < data_bytes {
                return Ok(None);
            }
        }
        Ok(Some((record, data_at + data_bytes)))
    }

    /// Reads connections and chunk locations from the end of the file. Returns `false` if they are incomplete.
    fn read_index(&mut self, index_at: u64) -> Result<bool> {
        let shares = Shares::of(self.spill.budget());
        let mut lists: HashSet<Arc<[usize]>> = HashSet::new();
        let mut at = index_at;
        while at < self.file.len {
            let Some((record, next)) = self.record(at)? else { return Ok(self.forget()) };
            match record.op {
                Some(RecordKind::Connection) => self.connect(&record, &record.data),
                Some(RecordKind::ChunkInfo) => {
                    let Some((offset, start_ns)) = record.u64("chunk_pos").zip(record.time_ns("start_time"))
                    else {
                        return Ok(self.forget());
                    };
                    let mut topics = Vec::new();
                    for pair in record.data.chunks_exact(8) {
                        let [a, b, c, d, rest @ ..] = pair else { continue };
                        let count = rest.first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
                        let connection = u32::from_le_bytes([*a, *b, *c, *d]);
                        let Some(topic) = self.topic_of(connection) else {
                            return Ok(self.forget());
                        };
                        let Some(topic) = topic else { continue };
                        self.topics.count(topic, u64::from(count));
                        if topics.last() != Some(&topic) {
                            topics.push(topic);
                        }
                    }
                    topics.sort_unstable();
                    topics.dedup();
                    let topics: Arc<[usize]> = topics.into();
                    let topics = Some(lists.get(&topics).cloned().unwrap_or_else(|| {
                        lists.insert(Arc::clone(&topics));
                        topics
                    }));
                    let bytes = self.file.len.saturating_sub(offset);
                    check_chunks(self.chunks.len(), shares, self.file.path())?;
                    self.chunks.push(ChunkPlace { offset, bytes, start_ns, topics, is_bare: false });
                }
                _ => return Ok(self.forget()),
            }
            at = next;
        }
        Ok(!self.chunks.is_empty() || !self.connections.is_empty() || self.forget())
    }

    /// Discards a broken index.
    fn forget(&mut self) -> bool {
        self.topics = TopicList::default();
        self.connections.clear();
        self.chunks.clear();
        false
    }

    /// Finds chunks one by one and inspects each, if there is no index.
    fn scan(&mut self) -> Result<()> {
        let mut at = MAGIC.len() as u64;
        let (mut walk, mut cut) = (Walk::default(), String::new());
        while let Some((record, next)) = self.record(at)? {
            if next > self.file.len {
                cut = cut_at(at, self.file.len, Some(next));
            }
            if record.op == Some(RecordKind::Connection) {
                self.connect(&record, &record.data);
            }
            if record.op == Some(RecordKind::Chunk) {
                self.look_into(at, next - at, &mut walk)?;
            }
            at = next;
        }
        let (path, len, messages) = (self.file.path().display(), self.file.len, walk.messages);
        if at < len {
            cut = cut_at(at, len, None);
        }
        let cut = match at == len {
            true => String::new(),
            false => format!(", and ends within a record (it was truncated{cut})"),
        };
        self.remarks.push(format!(
            "{path} has no index (the recorder did not close it){cut}: {messages} messages were found by reading the \
             whole file"
        ));
        Ok(())
    }

    fn connect(&mut self, record: &Record, data: &[u8]) {
        let Some(id) = record.u32("conn") else { return };
        if self.connections.len() >= MAX_CONNECTIONS && !self.connections.contains_key(&id) {
            return;
        }
        let type_name = Record::text_of(data, "type").unwrap_or_default();
        let name = record.text("topic").unwrap_or_default();
        let topic = self.topics.index(&name, &type_name, Some(Wire::Ros1));
        self.connections.insert(id, topic);
    }

    /// Returns the topic of a connection. The outer `None` means unknown, the inner one skipped.
    fn topic_of(&self, connection: u32) -> Option<Option<usize>> {
        let is_full = self.connections.len() >= MAX_CONNECTIONS;
        self.connections.get(&connection).copied().or(is_full.then_some(None))
    }

    /// Visits the records of a chunk.
    fn find_messages(&mut self, chunk: &mut OpenChunk, take: &mut TakeMessage<'_>) -> Result<()> {
        let is_broken = chunk.is_broken();
        let OpenChunk { bytes, complaint } = chunk;
        let (mut window, mut at) = (Window::default(), 0);
        while at < bytes.len() {
            let header_bytes =
                u32_of(bytes.piece(at, 4, &mut window)?).filter(|bytes| *bytes <= MAX_HEADER_BYTES);
            let head = match header_bytes {
                Some(header_bytes) => bytes.piece(at + 4, header_bytes as usize + 4, &mut window)?,
                None => None,
            };
            let head = head.and_then(|head| {
                let (header, data_bytes) = head.split_last_chunk()?;
                Some((Record::of(header)?, u64::from(u32::from_le_bytes(*data_bytes))))
            });
            let whole = head.and_then(|(record, data_bytes)| {
                let data_at = at + 8 + record.header_bytes;
                let end = data_at.checked_add(data_bytes).filter(|end| *end <= bytes.len())?;
                Some((record, data_at, end))
            });
            let Some((record, data_at, end)) = whole else {
                OpenChunk::note(complaint, format!("there is no record at byte {at} of its contents"));
                return Ok(());
            };
            let len = end - data_at;
            if record.op == Some(RecordKind::Connection) {
                let data_bytes = if len > MAX_RECORD_BYTES { 0 } else { len as usize };
                let data = bytes.piece(data_at, data_bytes, &mut window)?.unwrap_or_default();
                // Connection data from a broken chunk may be wrong, so known connections are kept.
                let is_known = record.u32("conn").is_some_and(|id| self.connections.contains_key(&id));
                if !(is_broken && is_known) {
                    self.connect(&record, data);
                }
            } else if record.op == Some(RecordKind::Message) {
                let topic = record.u32("conn").and_then(|id| self.topic_of(id));
                let Some((topic, log_ns)) = topic.zip(record.time_ns("time")) else {
                    OpenChunk::note(complaint, format!("byte {at}: the message has no connection or time"));
                    return Ok(());
                };
                if let Some(topic) = topic {
                    take(MessagePlace { log_ns, start: data_at, len, topic })?;
                }
            }
            at = end;
        }
        Ok(())
    }
}

/// Decodes four little-endian bytes.
fn u32_of(bytes: Option<&[u8]>) -> Option<u64> {
    bytes?.first_chunk().map(|bytes| u64::from(u32::from_le_bytes(*bytes)))
}

impl ChunkFile for Bag1 {
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
        let path = self.file.path().to_owned();
        let wrong = |reason: String| FormatError::at_offset(place.offset, reason).in_input(&path);
        let head = self.record(place.offset)?;
        let Some((record, end)) = head.filter(|(record, _)| record.op == Some(RecordKind::Chunk)) else {
            return Err(wrong(
                "there is no chunk at the place in the index: rebuild the index with `rosbag reindex`".into(),
            ));
        };
        let claimed = u64::from(record.u32("size").unwrap_or_default());
        let compression = record.text("compression").unwrap_or_default();
        let data_at = place.offset + 8 + record.header_bytes;
        let data_bytes = end.saturating_sub(data_at);
        if claimed.max(data_bytes) > MAX_CHUNK_BYTES {
            let reason = "chunks of more than 1 GiB are not supported: record smaller ones (rosbag record --chunksize)";
            return Err(wrong(reason.into()));
        }
        let there = data_bytes.min(self.file.len.saturating_sub(data_at));
        let is_packed = !matches!(compression.as_str(), "" | "none");
        let (memory_bytes, spill) = (self.order.chunk_bytes(), &mut self.spill);
        let part = self.file.whole()?.part(data_at, there);
        let (bytes, complaint) = self.file.stream(data_at, there, |input| match is_packed {
            true => {
                let size = StreamSize::Claimed(claimed);
                decompress(&compression, input, size, spill, memory_bytes, &mut |_| {})
            }
            false => plain(part, memory_bytes, input, &mut |_| {}),
        })?;
        let is_cut = there < data_bytes;
        let cut = || Complaint { reason: "the file ends within it".to_owned(), is_broken: false };
        let complaint = if is_cut { Some(cut()) } else { complaint };
        let mut chunk = OpenChunk { bytes, complaint };
        self.find_messages(&mut chunk, take)?;
        Ok(chunk)
    }
}

impl Recording for Bag1 {
    fn format(&self) -> &str {
        "ROS 1 bag"
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
