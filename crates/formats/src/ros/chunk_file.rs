use super::chunk::{ChunkPlace, MessagePlace, OpenChunk};
use super::chunk_order::{BrokenChunk, ChunkOrder, Step};
use super::recording::{Message, TopicList};
use crate::spill::{Budget, Complaint};
use std::collections::HashMap;
use std::path::Path;
use voxtile::{Error, FormatError, Result};

/// Recording whose messages are in chunks.
pub(super) trait ChunkFile {
    fn path(&self) -> &Path;

    fn order(&mut self) -> &mut ChunkOrder;

    /// Returns what to do next to read the messages in order.
    fn step(&mut self) -> Result<Step>;

    /// Reads a chunk and locates its messages.
    fn load(&mut self, place: &ChunkPlace, take: &mut TakeMessage<'_>) -> Result<OpenChunk>;

    /// Returns the topics and the chunk locations.
    fn found(&mut self) -> (&mut TopicList, &mut Vec<ChunkPlace>);

    /// Inspects the next chunk of a file without an index: adds its location and counts its messages.
    fn look_into(&mut self, offset: u64, bytes: u64, walk: &mut Walk) -> Result<()> {
        let start_ns = walk.start_ns.unwrap_or(i64::MIN);
        let place = ChunkPlace { offset, bytes, start_ns, topics: None, is_bare: false };
        let (mut earliest, mut counts) = (None, HashMap::<usize, u64>::new());
        let loaded = self.load(&place, &mut |MessagePlace { log_ns, topic, .. }| {
            *counts.entry(topic).or_default() += 1;
            earliest = Some(earliest.map_or(log_ns, |earliest: i64| earliest.min(log_ns)));
            Ok(())
        });
        match loaded {
            Err(error @ Error::Io { .. }) => return Err(error),
            Ok(chunk) if !chunk.is_broken() => walk.messages += counts.values().sum::<u64>(),
            // The messages of a broken chunk are reported as errors one by one.
            Ok(_) => earliest = None,
            Err(_) => (earliest, counts) = Default::default(),
        }
        walk.start_ns = earliest.or(walk.start_ns);
        check_chunks(self.found().1.len(), self.order().shares(), self.path())?;
        let (topics, places) = self.found();
        counts.into_iter().for_each(|(topic, messages)| topics.count(topic, messages));
        places.push(ChunkPlace { start_ns: walk.start_ns.unwrap_or(i64::MIN), ..place });
        Ok(())
    }

    /// Returns the next message of all chunks in time order. A damaged chunk is reported once, and its valid messages
    /// follow. In a broken chunk, each message is an error.
    fn next_in_order(&mut self) -> Result<Option<Message>> {
        loop {
            let place = match self.step()? {
                Step::Load(place) => place,
                Step::Message(message) => return Ok(Some(message)),
                Step::End => return Ok(None),
            };
            let wanted = std::mem::take(&mut self.order().topics);
            let (mut sorter, mut whole) = (self.order().sorter(), 0_u64);
            let loaded = self.load(&place, &mut |message| {
                if wanted.contains(message.topic) {
                    whole += 1;
                    return sorter.push(message);
                }
                Ok(())
            });
            self.order().topics = wanted;
            let mut chunk = loaded?;
            let sorted = sorter.finish()?;
            let Some(Complaint { reason, is_broken }) = chunk.complaint.take() else {
                self.order().open(Ok(chunk.bytes), sorted, whole)?;
                continue;
            };
            if is_broken && whole > 0 {
                let (path, offset) = (self.path().to_owned(), place.offset);
                self.order().open(Err(BrokenChunk { path, offset, reason }), sorted, whole)?;
                continue;
            }
            self.order().open(Ok(chunk.bytes), sorted, whole)?;
            let reason = format!("a chunk is damaged: {reason}; {whole} of its messages can be read");
            return Err(FormatError::at_offset(place.offset, reason).in_input(self.path()));
        }
    }
}

/// Callback for the messages of a chunk.
pub(super) type TakeMessage<'t> = dyn FnMut(MessagePlace) -> Result<()> + 't;

/// Division of a recording's memory budget, in bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shares {
    /// For the contents of chunks that are read concurrently.
    pub(super) chunks: usize,
    /// For the locations of their messages.
    pub(super) messages: usize,
    /// For the locations of all chunks.
    pub(super) places: usize,
}

impl Shares {
    pub(super) fn of(budget: &Budget) -> Self {
        Self {
            chunks: budget.bytes / 2,
            messages: budget.bytes / 4,
            // The smallest budget suffices for a few hundred gigabytes of chunks.
            places: usize::try_from(budget.whole_bytes()).unwrap_or(usize::MAX),
        }
    }
}

/// Statistics from reading a file without an index.
#[derive(Debug, Default)]
pub(super) struct Walk {
    pub(super) messages: u64,
    /// Earliest message of the last chunk that had messages.
    start_ns: Option<i64>,
}

/// Checks that one more chunk location fits in memory.
pub(super) fn check_chunks(chunks: usize, shares: Shares, path: &Path) -> Result<()> {
    // The order of chunks takes one index per chunk.
    if chunks < shares.places / (size_of::<ChunkPlace>() + size_of::<u32>()) {
        return Ok(());
    }
    let reason = format!(
        "has more than {} chunks, whose index would exceed {} bytes of memory: raise `memory`, or record with larger \
         chunks",
        chunks, shares.places
    );
    Err(Error::argument(path.display().to_string(), reason))
}
