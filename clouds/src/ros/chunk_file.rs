use super::chunk::{ChunkPlace, OpenChunk};
use super::chunk_order::{ChunkOrder, Step};
use super::recording::Message;
use crate::error::{Error, Place, Result};
use std::path::Path;

/// A recording whose messages lie in chunks.
pub(super) trait ChunkFile {
    fn path(&self) -> &Path;

    fn order(&mut self) -> &mut ChunkOrder;

    /// Reads a chunk; of its messages those of some topics, or of all.
    fn load(&mut self, place: &ChunkPlace, wanted: Option<&[usize]>) -> Result<OpenChunk>;

    /// The next message of all chunks, in order of time. A damaged chunk is told of once; what is whole of it follows.
    fn next_in_order(&mut self) -> Result<Option<Message>> {
        loop {
            let place = match self.order().step() {
                Step::Load(place) => place,
                Step::Message(message) => return Ok(Some(message)),
                Step::End => return Ok(None),
            };
            let wanted = self.order().topics.clone();
            let mut chunk = self.load(&place, Some(&wanted))?;
            let complaint = chunk.complaint.take();
            let whole = chunk.messages.len();
            self.order().open(chunk);
            if let Some(complaint) = complaint {
                let reason = format!("a chunk is damaged: {complaint}; {whole} messages of it can be read");
                return Err(Error::format(self.path(), Place::Byte(place.offset), reason));
            }
        }
    }
}
