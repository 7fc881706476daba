use super::Result;
use super::out_file::OutFile;
use std::path::Path;

/// First and last bytes of an MCAP file.
const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// Size of a record's type and length.
const RECORD_HEAD_BYTES: u64 = 9;
/// Size of a message before its data: channel, sequence number, two times.
const MESSAGE_HEAD_BYTES: u64 = 2 + 4 + 8 + 8;
/// IDs of the only schema and channel. A schema ID of 0 would mean no schema.
const SCHEMA: u16 = 1;
const CHANNEL: u16 = 1;

/// Record types, see <https://mcap.dev/spec>.
mod op {
    pub(super) const HEADER: u8 = 1;
    pub(super) const FOOTER: u8 = 2;
    pub(super) const SCHEMA: u8 = 3;
    pub(super) const CHANNEL: u8 = 4;
    pub(super) const MESSAGE: u8 = 5;
    pub(super) const CHUNK: u8 = 6;
    pub(super) const MESSAGE_INDEX: u8 = 7;
    pub(super) const CHUNK_INDEX: u8 = 8;
    pub(super) const STATISTICS: u8 = 11;
    pub(super) const SUMMARY_OFFSET: u8 = 14;
    pub(super) const DATA_END: u8 = 15;
}

/// Topic of the messages of a file.
pub(super) struct Topic<'t> {
    pub(super) name: &'t str,
    /// ROS message type, such as `sensor_msgs/msg/PointCloud2`.
    pub(super) type_name: &'t str,
    /// Message definition in `ros2msg` format.
    pub(super) definition: &'t str,
}

/// Writer of a ROS 2 MCAP file with one topic. Every message is an uncompressed chunk of its own, with an index.
pub(super) struct McapFile {
    out: OutFile,
    /// Schema and channel records, which the summary repeats.
    schema: Vec<u8>,
    channel: Vec<u8>,
    chunks: Vec<Chunk>,
}

/// Location of a chunk.
struct Chunk {
    log_ns: u64,
    offset: u64,
    bytes: u64,
    record_bytes: u64,
    index_bytes: u64,
}

/// Builder of record contents.
#[derive(Default)]
struct Contents(Vec<u8>);

impl Contents {
    fn u16(mut self, number: u16) -> Self {
        self.0.extend(number.to_le_bytes());
        self
    }

    fn u32(mut self, number: u32) -> Self {
        self.0.extend(number.to_le_bytes());
        self
    }

    fn u64(mut self, number: u64) -> Self {
        self.0.extend(number.to_le_bytes());
        self
    }

    /// Appends length-prefixed bytes, as used for texts and maps.
    fn sized(mut self, bytes: &[u8]) -> Self {
        self.0.extend((bytes.len() as u32).to_le_bytes());
        self.0.extend(bytes);
        self
    }

    fn text(self, text: &str) -> Self {
        self.sized(text.as_bytes())
    }

    /// Returns the complete record.
    fn record(self, kind: u8) -> Vec<u8> {
        [&[kind][..], &(self.0.len() as u64).to_le_bytes(), &self.0].concat()
    }
}

impl McapFile {
    pub(super) fn create(path: &Path, topic: &Topic<'_>) -> Result<Self> {
        let mut out = OutFile::create(path)?;
        let library = concat!("voxtile-clouds ", env!("CARGO_PKG_VERSION"));
        out.write(MAGIC)?;
        out.write(&Contents::default().text("ros2").text(library).record(op::HEADER))?;
        let schema = Contents::default().u16(SCHEMA).text(topic.type_name).text("ros2msg");
        let schema = schema.text(topic.definition).record(op::SCHEMA);
        let channel = Contents::default().u16(CHANNEL).u16(SCHEMA).text(topic.name).text("cdr");
        let channel = channel.sized(&[]).record(op::CHANNEL);
        out.write(&schema)?;
        out.write(&channel)?;
        Ok(Self { out, schema, channel, chunks: Vec::new() })
    }

    /// Writes a message of the topic. Recording times must not decrease.
    pub(super) fn write(&mut self, log_ns: u64, publish_ns: u64, data: &[u8]) -> Result<()> {
        let mut message = vec![op::MESSAGE];
        message.extend((MESSAGE_HEAD_BYTES + data.len() as u64).to_le_bytes());
        let head = Contents(message).u16(CHANNEL).u32(self.chunks.len() as u32).u64(log_ns).u64(publish_ns).0;
        let mut sum = crc32fast::Hasher::new();
        sum.update(&head);
        sum.update(data);
        let record_bytes = (head.len() + data.len()) as u64;
        let chunk = Contents::default().u64(log_ns).u64(log_ns).u64(record_bytes).u32(sum.finalize());
        let chunk = chunk.text("").u64(record_bytes).0;
        let chunk_bytes = chunk.len() as u64 + record_bytes;

        let offset = self.out.len();
        self.out.write(&[op::CHUNK])?;
        self.out.write(&chunk_bytes.to_le_bytes())?;
        for part in [&chunk[..], &head, data] {
            self.out.write(part)?;
        }
        // The only message is at the start of the chunk.
        let entry = Contents::default().u64(log_ns).u64(0).0;
        let index = Contents::default().u16(CHANNEL).sized(&entry).record(op::MESSAGE_INDEX);
        self.out.write(&index)?;
        self.chunks.push(Chunk {
            log_ns,
            offset,
            bytes: RECORD_HEAD_BYTES + chunk_bytes,
            record_bytes,
            index_bytes: index.len() as u64,
        });
        Ok(())
    }

    /// Writes the summary with the indexes.
    pub(super) fn finish(mut self) -> Result<()> {
        // No checksum of the data section: chunks have their own.
        self.out.write(&Contents::default().u32(0).record(op::DATA_END))?;
        let start = self.out.len();
        let chunks: Vec<u8> = self.chunks.iter().flat_map(Chunk::index).collect();
        let groups = [
            (op::SCHEMA, std::mem::take(&mut self.schema)),
            (op::CHANNEL, std::mem::take(&mut self.channel)),
            (op::STATISTICS, self.statistics()),
            (op::CHUNK_INDEX, chunks),
        ];
        let (mut summary, mut offsets) = (Vec::new(), Vec::new());
        for (kind, records) in groups.into_iter().filter(|(_, records)| !records.is_empty()) {
            let place = Contents(vec![kind]).u64(start + summary.len() as u64).u64(records.len() as u64);
            offsets.extend(place.record(op::SUMMARY_OFFSET));
            summary.extend(records);
        }
        let offsets_start = start + summary.len() as u64;
        summary.extend(offsets);
        // The checksum covers the summary and the footer up to the checksum itself.
        let footer = Contents::default().u64(start).u64(offsets_start).u32(0).record(op::FOOTER);
        summary.extend(&footer[..footer.len() - size_of::<u32>()]);
        let sum = crc32fast::hash(&summary);
        self.out.write(&summary)?;
        self.out.write(&sum.to_le_bytes())?;
        self.out.write(MAGIC)?;
        self.out.finish()
    }

    fn statistics(&self) -> Vec<u8> {
        let count = self.chunks.len() as u64;
        let times = || self.chunks.iter().map(|chunk| chunk.log_ns);
        let by_channel = Contents::default().u16(CHANNEL).u64(count).0;
        // Counts of messages, schemas, channels, attachments, metadata records and chunks.
        let counts = Contents::default().u64(count).u16(1).u32(1).u32(0).u32(0).u32(count as u32);
        let times = counts.u64(times().min().unwrap_or(0)).u64(times().max().unwrap_or(0));
        times.sized(&by_channel).record(op::STATISTICS)
    }
}

impl Chunk {
    fn index(&self) -> Vec<u8> {
        let index_offsets = Contents::default().u16(CHANNEL).u64(self.offset + self.bytes).0;
        let index = Contents::default().u64(self.log_ns).u64(self.log_ns).u64(self.offset).u64(self.bytes);
        let index = index.sized(&index_offsets).u64(self.index_bytes).text("");
        index.u64(self.record_bytes).u64(self.record_bytes).record(op::CHUNK_INDEX)
    }
}
