use super::chunk::{ChunkPlace, MAX_CHUNK_BYTES, MessagePlace};
use super::chunk_file::Shares;
use super::message_data::{MessageData, read};
use super::recording::{Message, TopicSet};
use crate::spill::{Budget, Bytes, Record, Sorted, Sorter};
use std::path::{Path, PathBuf};
use voxtile::{Error, FormatError, Result};

/// Merges the messages of chunks in time order. Chunks that overlap in time are open together.
#[derive(Debug)]
pub(super) struct ChunkOrder {
    pub(super) topics: TopicSet,
    budget: Budget,
    /// Chunk numbers sorted by start time.
    order: Vec<u32>,
    next: usize,
    open: Vec<Playing>,
    /// Whether messages may be out of order because too many chunks overlap.
    has_given_up: bool,
}

#[derive(Debug)]
struct Playing {
    bytes: std::result::Result<Bytes, BrokenChunk>,
    /// The next message.
    head: MessagePlace,
    /// Later messages in time order, and the number of all messages.
    rest: Sorted<MessagePlace>,
    messages: u64,
    /// Number of the chunk in its file.
    number: usize,
}

/// A chunk in which any byte may be wrong. Each of its messages is an error, so that later messages keep their numbers.
#[derive(Debug)]
pub(super) struct BrokenChunk {
    pub(super) path: PathBuf,
    pub(super) offset: u64,
    pub(super) reason: String,
}

impl BrokenChunk {
    fn error(&self, log_ns: i64) -> Error {
        let reason =
            format!("a chunk is damaged: {}; its message recorded at {log_ns} ns is skipped", self.reason);
        FormatError::at_offset(self.offset, reason).in_input(&self.path)
    }
}

impl Playing {
    fn bytes(&self) -> Option<&Bytes> {
        self.bytes.as_ref().ok()
    }
}

/// Next action of the caller.
#[derive(Debug)]
pub(super) enum Step {
    /// Read this chunk and pass it to [`ChunkOrder::open`].
    Load(ChunkPlace),
    /// Use this message.
    Message(Message),
    /// All messages were returned.
    End,
}

/// Limit for open chunks.
const MAX_OPEN: usize = 1024;
/// Messages up to this size are copied to memory.
const SMALL_BYTES: u64 = 1 << 16;

impl ChunkOrder {
    pub(super) fn new(budget: &Budget) -> Self {
        let (topics, order, open) = Default::default();
        Self { topics, budget: budget.clone(), order, next: 0, open, has_given_up: false }
    }

    /// Starts a pass over these chunks.
    pub(super) fn begin(&mut self, places: &[ChunkPlace], topics: &[usize]) {
        let topics = TopicSet::of(topics);
        let is_wanted = |place: &ChunkPlace| {
            place.topics.as_ref().is_none_or(|there| there.iter().any(|topic| topics.contains(*topic)))
        };
        let mut order: Vec<u32> =
            (0..).zip(places).filter(|(_, place)| is_wanted(place)).map(|(number, _)| number).collect();
        order.sort_by_key(|number| places.get(*number as usize).map(|place| (place.start_ns, place.offset)));
        *self = Self { topics, order, ..Self::new(&self.budget) };
    }

    /// Returns the division of the memory budget.
    pub(super) fn shares(&self) -> Shares {
        Shares::of(&self.budget)
    }

    /// Returns a sorter for the messages of a chunk to load.
    pub(super) fn sorter(&self) -> Sorter<MessagePlace> {
        let share = Shares::of(&self.budget).messages as u64;
        let held: u64 = self.open.iter().map(|playing| playing.messages * MessagePlace::BYTES as u64).sum();
        Sorter::new(&self.budget, usize::try_from(share.saturating_sub(held)).unwrap_or(0))
    }

    /// Returns the memory available for a chunk to load.
    pub(super) fn chunk_bytes(&self) -> usize {
        let held: usize = self.open.iter().filter_map(Playing::bytes).map(Bytes::in_memory).sum();
        Shares::of(&self.budget).chunks.saturating_sub(held)
    }

    /// Returns the next step.
    pub(super) fn step(&mut self, places: &[ChunkPlace]) -> Result<Step> {
        let earliest = self.earliest();
        let next = self.order.get(self.next).and_then(|number| places.get(*number as usize));
        if let Some(place) = next {
            let is_due = earliest.is_none_or(|(_, log_ns)| place.start_ns <= log_ns);
            let held: u64 = self.open.iter().filter_map(Playing::bytes).map(Bytes::len).sum();
            // Without this limit, a file whose chunks all overlap would be open completely.
            let is_room = earliest.is_none() || (held < MAX_CHUNK_BYTES && self.open.len() < MAX_OPEN);
            self.has_given_up |= is_due && !is_room;
            if is_due && is_room {
                self.next += 1;
                return Ok(Step::Load(place.clone()));
            }
        }
        match earliest {
            Some((index, _)) => Ok(self.take(index)?.map_or(Step::End, Step::Message)),
            None => Ok(Step::End),
        }
    }

    /// Returns a remark for the user about the order of a file's messages.
    pub(super) fn remark(&self, path: &Path) -> Option<String> {
        let text =
            || format!("{}: its chunks overlap so much that messages are out of order", path.display());
        self.has_given_up.then(text)
    }

    /// Adds a loaded chunk and its messages.
    pub(super) fn open(
        &mut self,
        bytes: std::result::Result<Bytes, BrokenChunk>,
        mut rest: Sorted<MessagePlace>,
        messages: u64,
    ) -> Result<()> {
        if let Some(head) = rest.next()? {
            self.open.push(Playing { bytes, head, rest, messages, number: self.next });
        }
        Ok(())
    }

    /// Returns the open chunk with the earliest message, and its time.
    fn earliest(&self) -> Option<(usize, i64)> {
        let heads = self.open.iter().enumerate();
        let heads = heads.map(|(index, playing)| (playing.head.log_ns, playing.number, index));
        heads.min().map(|(log_ns, _, index)| (index, log_ns))
    }

    fn take(&mut self, index: usize) -> Result<Option<Message>> {
        let Some(playing) = self.open.get_mut(index) else { return Ok(None) };
        let MessagePlace { log_ns, topic, start, len } = playing.head;
        let data = match &playing.bytes {
            Err(broken) => Err(broken.error(log_ns)),
            Ok(Bytes::Memory(bytes)) => {
                let range = usize::try_from(start).ok().zip(usize::try_from(len).ok());
                let data = range.and_then(|(start, len)| bytes.get(start..start.checked_add(len)?));
                Ok(Bytes::Memory(data.unwrap_or_default().to_vec()))
            }
            Ok(Bytes::File(part)) if len <= SMALL_BYTES => {
                read(&part.part(start, len), len).map(Bytes::Memory)
            }
            Ok(Bytes::File(part)) => Ok(Bytes::File(part.part(start, len))),
        };
        // Skip a message that cannot be read; otherwise it would be returned again forever.
        match playing.rest.next()? {
            Some(next) => playing.head = next,
            None => drop(self.open.swap_remove(index)),
        }
        Ok(Some(Message { topic, log_ns, data: MessageData(data?) }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spill::FilePart;

    #[test]
    fn unreadable_messages_are_reported_once() {
        let cut = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(cut.path(), [7; 10]).unwrap();
        let mut order = ChunkOrder::new(&Budget::default());
        let mut sorter = order.sorter();
        for start in [0, 8, 16] {
            sorter.push(MessagePlace { log_ns: 5, start, len: 8, topic: 0 }).unwrap();
        }
        let bytes = Bytes::File(FilePart::open(cut.path(), 0, 24).unwrap());
        order.open(Ok(bytes), sorter.finish().unwrap(), 3).unwrap();
        assert!(matches!(order.step(&[]), Ok(Step::Message(message)) if message.data.len() == 8));
        assert!(order.step(&[]).is_err() && order.step(&[]).is_err());
        assert!(matches!(order.step(&[]), Ok(Step::End)));
    }
}
