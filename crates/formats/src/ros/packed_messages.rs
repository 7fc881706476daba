use super::chunk::{MAX_CHUNK_BYTES, decompress};
use super::message_data::{MessageData, read};
use super::recording::{Message, Recording, Topic};
use super::wire::Wire;
use crate::spill::{Budget, Bytes, SpillFile, StreamSize};
use std::path::{Path, PathBuf};
use voxtile::{Error, Result};

/// Recording with individually compressed messages (`compression_mode: MESSAGE`), detected by signatures that no CDR
/// message starts with.
pub(super) struct PackedMessages<R> {
    recording: R,
    path: PathBuf,
    spill: SpillFile,
}

/// Signatures of compressed messages.
const MAGICS: [(&[u8], &str); 2] = [(b"\x28\xb5\x2f\xfd", "zstd"), (b"\x04\x22\x4d\x18", "lz4")];
const MAGIC_BYTES: u64 = 4;

impl<R: Recording> PackedMessages<R> {
    pub(super) fn new(recording: R, path: &Path, budget: &Budget) -> Self {
        Self { recording, path: path.to_owned(), spill: SpillFile::new(budget) }
    }

    fn unpack(&mut self, message: Message) -> Result<Message> {
        let start = match &message.data.0 {
            Bytes::Memory(bytes) => bytes.get(..MAGIC_BYTES as usize).unwrap_or_default(),
            Bytes::File(part) => &read(part, MAGIC_BYTES)?,
        };
        let Some((_, name)) = MAGICS.iter().find(|(magic, _)| start.starts_with(magic)) else {
            return Ok(message);
        };
        let memory_bytes = self.spill.budget().bytes / 2;
        let size = StreamSize::AtMost(MAX_CHUNK_BYTES);
        let see = &mut |_: &[u8]| {};
        let (data, complaint) = match &message.data.0 {
            Bytes::Memory(bytes) => {
                decompress(name, bytes.as_slice(), size, &mut self.spill, memory_bytes, see)?
            }
            Bytes::File(part) => decompress(name, part.reader(), size, &mut self.spill, memory_bytes, see)?,
        };
        if let Some(complaint) = complaint {
            let (log_ns, why) = (message.log_ns, complaint.reason);
            let reason = format!("a message recorded at {log_ns} ns cannot be decompressed: {why}");
            return Err(Error::argument(self.path.display().to_string(), reason));
        }
        Ok(Message { data: MessageData(data), ..message })
    }
}

impl<R: Recording> Recording for PackedMessages<R> {
    fn format(&self) -> &str {
        self.recording.format()
    }

    fn topics(&self) -> &[Topic] {
        self.recording.topics()
    }

    fn begin(&mut self, topics: &[usize]) -> Result<()> {
        self.recording.begin(topics)
    }

    fn next_message(&mut self) -> Result<Option<Message>> {
        let Some(message) = self.recording.next_message()? else { return Ok(None) };
        let wire = self.recording.topics().get(message.topic).and_then(|topic| topic.wire);
        match wire {
            Some(Wire::Cdr) => self.unpack(message).map(Some),
            _ => Ok(Some(message)),
        }
    }

    fn close_files(&mut self) {
        self.recording.close_files();
    }

    fn remarks(&self) -> Vec<String> {
        self.recording.remarks()
    }
}
