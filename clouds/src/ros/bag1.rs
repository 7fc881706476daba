use super::bag1_record::{Record, RecordKind};
use super::chunk::{ChunkPlace, MOST_CHUNK_BYTES, MessagePlace, OpenChunk, decompress};
use super::chunk_file::ChunkFile;
use super::chunk_order::ChunkOrder;
use super::file_bytes::FileBytes;
use super::recording::{Message, Recording, Topic, TopicList};
use super::wire::Wire;
use crate::error::{Error, Place, Result};
use std::collections::HashMap;
use std::path::Path;

/// A `.bag` of ROS 1, version 2.0. Its index is read if there is one; otherwise the file is read once before.
#[derive(Debug)]
pub struct Bag1 {
    file: FileBytes,
    topics: TopicList,
    /// The topic of a connection.
    connections: HashMap<u32, usize>,
    chunks: Vec<ChunkPlace>,
    order: ChunkOrder,
    remarks: Vec<String>,
}

const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// A longer record outside of chunks is not read.
const MOST_RECORD_BYTES: u64 = 64 << 20;

impl Bag1 {
    /// Opens a file.
    ///
    /// # Errors
    ///
    /// A file that cannot be read or is no such bag.
    pub fn open(path: &Path) -> Result<Self> {
        let mut file = FileBytes::open(path)?;
        let magic = file.read_at(0, MAGIC.len() as u64)?;
        if magic != MAGIC {
            let reason = if magic.starts_with(b"#ROSBAG V1") {
                "a bag of version 1 is older than is read; `rosbag fix` or `rosbag reindex` makes version 2.0 of it"
            } else {
                "it does not start with `#ROSBAG V2.0`: it is no bag of ROS 1"
            };
            return Err(Error::format(path, Place::Byte(0), reason));
        }
        let mut bag = Self {
            file,
            topics: TopicList::default(),
            connections: HashMap::new(),
            chunks: Vec::new(),
            order: ChunkOrder::default(),
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

    /// The record at a place, with the place behind it. The data of chunks and indices are left out. `None` where no
    /// whole header is.
    fn record(&mut self, offset: u64) -> Result<Option<(Record, u64)>> {
        let start = self.file.read_at(offset, 4)?;
        let Some(header_bytes) = start.first_chunk().map(|bytes| u64::from(u32::from_le_bytes(*bytes)))
        else {
            return Ok(None);
        };
        let header = self.file.read_at(offset + 4, (header_bytes + 4).min(MOST_RECORD_BYTES))?;
        let Some((fields, data_bytes)) =
            header.split_last_chunk().filter(|_| header.len() as u64 == header_bytes + 4)
        else {
            return Ok(None);
        };
        let data_bytes = u64::from(u32::from_le_bytes(*data_bytes));
        let data_at = offset + 8 + header_bytes;
        let Some(mut record) = Record::of(fields) else { return Ok(None) };
        if matches!(record.op, Some(RecordKind::Connection | RecordKind::ChunkInfo)) {
            if data_bytes > MOST_RECORD_BYTES {
                return Ok(None);
            }
            record.data = self.file.read_at(data_at, data_bytes)?;
            if (record.data.len() as u64) < data_bytes {
                return Ok(None);
            }
        }
        Ok(Some((record, data_at + data_bytes)))
    }

    /// Reads connections and places of chunks from the end of the file; `false` if they are not all there.
    fn read_index(&mut self, index_at: u64) -> Result<bool> {
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
                        let Some(&topic) = self.connections.get(&connection) else {
                            return Ok(self.forget());
                        };
                        self.topics.count(topic, u64::from(count));
                        topics.push(topic);
                    }
                    let bytes = self.file.len.saturating_sub(offset);
                    let topics = Some(topics);
                    self.chunks.push(ChunkPlace { offset, bytes, start_ns, topics, is_bare: false });
                }
                _ => return Ok(self.forget()),
            }
            at = next;
        }
        Ok(!self.chunks.is_empty() || !self.connections.is_empty() || self.forget())
    }

    /// Forgets a broken index.
    fn forget(&mut self) -> bool {
        self.topics = TopicList::default();
        self.connections.clear();
        self.chunks.clear();
        false
    }

    /// Finds chunks one after the other and looks into each, where there is no index.
    fn scan(&mut self) -> Result<()> {
        let mut at = MAGIC.len() as u64;
        let mut start_ns = i64::MIN;
        let mut messages = 0_u64;
        while let Some((record, next)) = self.record(at)? {
            if record.op == Some(RecordKind::Connection) {
                self.connect(&record, &record.data);
            }
            if record.op == Some(RecordKind::Chunk) {
                let place =
                    ChunkPlace { offset: at, bytes: next - at, start_ns, topics: None, is_bare: false };
                // A bad chunk is told of when it is its turn; others come behind it.
                let chunk = self.load(&place, None).unwrap_or_default();
                for message in &chunk.messages {
                    self.topics.count(message.topic, 1);
                }
                messages += chunk.messages.len() as u64;
                start_ns = chunk.messages.iter().map(|message| message.log_ns).min().unwrap_or(start_ns);
                self.chunks.push(ChunkPlace { start_ns, ..place });
            }
            at = next;
        }
        let (path, len) = (self.file.path().display(), self.file.len);
        let cut = if at == len { "" } else { ", which ends in the midst of a record (it was cut off)" };
        self.remarks.push(format!(
            "{path} has no index (the recorder did not close it){cut}: {messages} messages were found by reading it \
             whole"
        ));
        Ok(())
    }

    fn connect(&mut self, record: &Record, data: &[u8]) {
        let Some(id) = record.u32("conn") else { return };
        let type_name = Record::fields_of(data).and_then(|fields| fields.text("type")).unwrap_or_default();
        let name = record.text("topic").unwrap_or_default();
        let topic = self.topics.index(&name, &type_name, Some(Wire::Ros1));
        self.connections.insert(id, topic);
    }

    /// Walks over the records of a chunk.
    fn find_messages(&mut self, chunk: &mut OpenChunk, wanted: Option<&[usize]>) {
        let mut at = 0;
        while at < chunk.bytes.len() {
            let Some((record, data, next)) = Record::in_chunk(&chunk.bytes, at) else {
                chunk.complaint.get_or_insert_with(|| format!("byte {at} of its contents starts no record"));
                return;
            };
            if record.op == Some(RecordKind::Connection) {
                let data = chunk.bytes.get(data).unwrap_or_default();
                self.connect(&record, data);
            } else if record.op == Some(RecordKind::Message) {
                let topic = record.u32("conn").and_then(|id| self.connections.get(&id).copied());
                let Some((topic, log_ns)) = topic.zip(record.time_ns("time")) else {
                    chunk
                        .complaint
                        .get_or_insert_with(|| format!("byte {at}: a message without connection or time"));
                    return;
                };
                if wanted.is_none_or(|wanted| wanted.contains(&topic)) {
                    chunk.messages.push(MessagePlace { log_ns, topic, range: data });
                }
            }
            at = next;
        }
    }
}

impl ChunkFile for Bag1 {
    fn path(&self) -> &Path {
        self.file.path()
    }

    fn order(&mut self) -> &mut ChunkOrder {
        &mut self.order
    }

    fn load(&mut self, place: &ChunkPlace, wanted: Option<&[usize]>) -> Result<OpenChunk> {
        let path = self.file.path().to_owned();
        let wrong = |reason: String| Error::format(&path, Place::Byte(place.offset), reason);
        let head = self.record(place.offset)?;
        let Some((record, end)) = head.filter(|(record, _)| record.op == Some(RecordKind::Chunk)) else {
            return Err(wrong(
                "there is no chunk where the index says so; `rosbag reindex` makes a new index".into(),
            ));
        };
        let claimed = u64::from(record.u32("size").unwrap_or_default());
        let compression = record.text("compression").unwrap_or_default();
        let data_at = place.offset + 8 + record.header_bytes;
        let data_bytes = end.saturating_sub(data_at);
        if claimed.max(data_bytes) > MOST_CHUNK_BYTES {
            let reason =
                "a chunk of more than 1 GiB is not read; record smaller ones (rosbag record --chunksize)";
            return Err(wrong(reason.into()));
        }
        let data = self.file.read_at(data_at, data_bytes)?;
        let is_cut = (data.len() as u64) < data_bytes;
        let (bytes, complaint) = decompress(&compression, data, claimed);
        let complaint = if is_cut { Some("the file ends in the midst of it".to_owned()) } else { complaint };
        let mut chunk = OpenChunk { bytes, messages: Vec::new(), complaint };
        self.find_messages(&mut chunk, wanted);
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
        self.order = ChunkOrder::new(&self.chunks, topics);
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
