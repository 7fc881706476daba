use crate::spill::{Bytes, FilePart};
use voxtile::{Error, Result};

/// Bytes of a message, in memory or, if large, in a file.
#[derive(Clone, Debug, Default)]
pub struct MessageData(pub(super) Bytes);

impl MessageData {
    /// Returns the number of bytes.
    pub fn len(&self) -> u64 {
        self.0.len()
    }

    /// Returns whether there are no bytes.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the bytes if they are in memory.
    pub fn in_memory(&self) -> Option<&[u8]> {
        match &self.0 {
            Bytes::Memory(bytes) => Some(bytes),
            Bytes::File(_) => None,
        }
    }

    /// Loads the bytes into memory.
    ///
    /// # Errors
    ///
    /// There are more than `max_bytes`, or a file cannot be read.
    pub fn load(&mut self, max_bytes: u64) -> Result<&[u8]> {
        if let Bytes::File(part) = &self.0 {
            if part.len() > max_bytes {
                let reason = format!(
                    "{} bytes; messages of its kind must fit in {max_bytes} bytes of memory: raise `memory`, or do \
                     not select the topic",
                    part.len()
                );
                return Err(Error::argument("message", reason));
            }
            self.0 = Bytes::Memory(read(part, part.len())?);
        }
        Ok(self.in_memory().unwrap_or_default())
    }
}

/// Reads the first bytes of a file part.
pub(super) fn read(part: &FilePart, bytes: u64) -> Result<Vec<u8>> {
    // The caller limits `bytes`.
    let mut taken = vec![0; usize::try_from(bytes.min(part.len())).unwrap_or(0)];
    part.read_at(0, &mut taken)?;
    Ok(taken)
}

impl From<Vec<u8>> for MessageData {
    fn from(bytes: Vec<u8>) -> Self {
        Self(Bytes::Memory(bytes))
    }
}
