use bytes::Bytes;
use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// The memory of answers that are being sent: a client that reads nothing holds its answer until it is disconnected.
pub struct AnswerMemory(Arc<Semaphore>);

/// All large answers together.
const MAX_BYTES: usize = 64 << 20;
/// Smaller answers do not count: there is one a connection.
const SMALL_BYTES: usize = 16 << 10;
/// Permits are counted in 32 bits.
const UNIT_BYTES: usize = 1 << 10;

/// An answer and its share of the memory, which is given back with the last slice.
struct Held {
    bytes: Bytes,
    _permit: OwnedSemaphorePermit,
}

impl AsRef<[u8]> for Held {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

impl AnswerMemory {
    pub fn new() -> Self {
        Self(Arc::new(Semaphore::new(MAX_BYTES / UNIT_BYTES)))
    }

    /// Takes the share of an answer; `None` if other answers hold too much.
    pub fn hold(&self, bytes: Bytes) -> Option<Bytes> {
        if bytes.len() <= SMALL_BYTES {
            return Some(bytes);
        }
        let units = bytes.len().div_ceil(UNIT_BYTES).min(MAX_BYTES / UNIT_BYTES);
        let permit = self.0.clone().try_acquire_many_owned(u32::try_from(units).ok()?).ok()?;
        Some(Bytes::from_owner(Held { bytes, _permit: permit }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_of_an_answer_is_given_back_with_its_last_slice() {
        let memory = AnswerMemory::new();
        let answer = || Bytes::from(vec![1; MAX_BYTES / 2]);
        let first = memory.hold(answer()).unwrap();
        let mut second = memory.hold(answer()).unwrap();
        assert!(memory.hold(answer()).is_none());
        assert!(memory.hold(Bytes::from(vec![1; SMALL_BYTES])).is_some());
        let slice = second.split_to(10);
        drop(second);
        assert!(memory.hold(answer()).is_none());
        drop(slice);
        assert!(memory.hold(answer()).is_some());
        drop(first);
        // One that is larger than all waits for nothing and takes everything.
        let largest = memory.hold(Bytes::from(vec![1; MAX_BYTES + 1])).unwrap();
        assert!(memory.hold(answer()).is_none());
        drop(largest);
    }
}
