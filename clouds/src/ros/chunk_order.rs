use super::chunk::{ChunkPlace, MOST_CHUNK_BYTES, MessagePlace, OpenChunk};
use super::recording::Message;
use std::path::Path;

/// Puts the messages of chunks in order of time. Chunks overlap a little; those that do are in memory together.
#[derive(Debug, Default)]
pub(super) struct ChunkOrder {
    /// What messages are wanted of.
    pub(super) topics: Vec<usize>,
    /// In order of their starts.
    places: Vec<ChunkPlace>,
    next: usize,
    open: Vec<Playing>,
    /// Messages may be out of order, because too many chunks overlap.
    has_given_up: bool,
}

#[derive(Debug)]
struct Playing {
    chunk: OpenChunk,
    /// In order of time.
    next: usize,
    /// Number of the chunk in its file.
    number: usize,
}

/// What to do next.
#[derive(Debug)]
pub(super) enum Step {
    /// Read this chunk and give it to [`ChunkOrder::open`].
    Load(ChunkPlace),
    /// The next message.
    Message(Message),
    /// There is nothing left.
    End,
}

impl ChunkOrder {
    /// Begins with these chunks.
    pub(super) fn new(places: &[ChunkPlace], topics: &[usize]) -> Self {
        let is_wanted = |place: &&ChunkPlace| {
            place.topics.as_ref().is_none_or(|there| topics.iter().any(|topic| there.contains(topic)))
        };
        let mut places: Vec<_> = places.iter().filter(is_wanted).cloned().collect();
        places.sort_by_key(|place| (place.start_ns, place.offset));
        Self { topics: topics.to_vec(), places, ..Self::default() }
    }

    /// The next step.
    pub(super) fn step(&mut self) -> Step {
        let earliest = self.earliest();
        if let Some(place) = self.places.get(self.next) {
            let is_due = earliest.is_none_or(|(_, log_ns)| place.start_ns <= log_ns);
            let held: u64 = self.open.iter().map(|playing| playing.chunk.bytes.len() as u64).sum();
            // A file whose chunks all overlap would be in memory as a whole.
            let is_room = earliest.is_none() || held < MOST_CHUNK_BYTES;
            self.has_given_up |= is_due && !is_room;
            if is_due && is_room {
                self.next += 1;
                return Step::Load(place.clone());
            }
        }
        let message = earliest.and_then(|(index, _)| self.take(index));
        message.map_or(Step::End, Step::Message)
    }

    /// What a person should know of the order of a file's messages.
    pub(super) fn remark(&self, path: &Path) -> Option<String> {
        let text =
            || format!("{}: its chunks overlap so much that messages come out of order", path.display());
        self.has_given_up.then(text)
    }

    /// Takes a chunk that was asked for.
    pub(super) fn open(&mut self, mut chunk: OpenChunk) {
        chunk.messages.sort_by_key(|place| (place.log_ns, place.range.start));
        if !chunk.messages.is_empty() {
            self.open.push(Playing { chunk, next: 0, number: self.next });
        }
    }

    /// The open chunk with the earliest message, and its time.
    fn earliest(&self) -> Option<(usize, i64)> {
        let heads = self.open.iter().enumerate().filter_map(|(index, playing)| {
            let place = playing.chunk.messages.get(playing.next)?;
            Some((place.log_ns, playing.number, index))
        });
        heads.min().map(|(log_ns, _, index)| (index, log_ns))
    }

    fn take(&mut self, index: usize) -> Option<Message> {
        let playing = self.open.get_mut(index)?;
        let MessagePlace { log_ns, topic, range } = playing.chunk.messages.get(playing.next)?.clone();
        let data = playing.chunk.bytes.get(range).unwrap_or_default().to_vec();
        playing.next += 1;
        if playing.next >= playing.chunk.messages.len() {
            self.open.swap_remove(index);
        }
        Some(Message { topic, log_ns, data })
    }
}
