use super::chunk::{ChunkPlace, MessagePlace, OpenChunk};
use super::chunk_order::{ChunkOrder, Step};
use super::recording::Message;
use crate::error::{Error, Place, Result};
use crate::spill::Budget;
use std::path::Path;

/// A recording whose messages lie in chunks.
pub(super) trait ChunkFile {
    fn path(&self) -> &Path;

    fn order(&mut self) -> &mut ChunkOrder;

    /// The next step of the order.
    fn step(&mut self) -> Result<Step>;

    /// Reads a chunk, and finds its messages.
    fn load(&mut self, place: &ChunkPlace, take: &mut TakeMessage<'_>) -> Result<OpenChunk>;

    /// The next message of all chunks, in order of time. A damaged chunk is told of once; what is whole of it follows.
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
                if wanted.contains(&message.topic) {
                    whole += 1;
                    return sorter.push(message);
                }
                Ok(())
            });
            self.order().topics = wanted;
            let mut chunk = loaded?;
            let complaint = chunk.complaint.take();
            self.order().open(chunk, sorter.finish()?, whole)?;
            if let Some(complaint) = complaint {
                let reason = format!("a chunk is damaged: {complaint}; {whole} messages of it can be read");
                return Err(Error::format(self.path(), Place::Byte(place.offset), reason));
            }
        }
    }
}

/// Takes the messages of a chunk.
pub(super) type TakeMessage<'t> = dyn FnMut(MessagePlace) -> Result<()> + 't;

/// How the memory of a recording is divided.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shares {
    /// For the bytes of chunks that are played together.
    pub(super) chunks: usize,
    /// For the places of their messages.
    pub(super) messages: usize,
    /// For the places of all chunks.
    pub(super) places: usize,
}

impl Shares {
    pub(super) fn of(budget: &Budget) -> Self {
        Self {
            chunks: budget.bytes / 2,
            messages: budget.bytes / 4,
            // In the first bytes of memory are those of a few hundred gigabytes.
            places: usize::try_from(budget.whole_bytes()).unwrap_or(usize::MAX),
        }
    }
}

/// Checks that the place of one more chunk fits in memory.
pub(super) fn check_chunks(chunks: usize, shares: Shares, path: &Path) -> Result<()> {
    // The order in which they are played takes a number for each.
    if chunks < shares.places / (size_of::<ChunkPlace>() + size_of::<u32>()) {
        return Ok(());
    }
    let reason = format!(
        "has more than {} chunks, whose places would exceed {} bytes of memory: raise --memory, or record with larger \
         chunks",
        chunks, shares.places
    );
    Err(Error::argument(path.display().to_string(), reason))
}
