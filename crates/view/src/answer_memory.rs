use super::connections::{Client, Connection, HeldBytes};
use bytes::Bytes;
use parking_lot::Mutex;
use std::collections::HashMap;
use std::sync::Arc;

/// Memory budget of responses in flight: a client that does not read holds its response until it is disconnected.
#[derive(Clone, Default)]
pub struct AnswerMemory(Arc<Mutex<Taken>>);

/// Maximum size of all large responses together.
const MAX_BYTES: usize = 64 << 20;
/// Maximum size of the responses to one client.
const MAX_BYTES_OF_CLIENT: usize = MAX_BYTES / 2;
/// Smaller responses do not count, because each connection has only one.
const SMALL_BYTES: usize = 16 << 10;

#[derive(Default)]
struct Taken {
    bytes: usize,
    of: HashMap<Client, usize>,
}

/// A response in flight; releases its share of the budget when its last slice is dropped.
struct Held {
    bytes: Bytes,
    client: Client,
    memory: AnswerMemory,
    /// The same share, counted for the connection.
    _held: HeldBytes,
}

impl AsRef<[u8]> for Held {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        let mut taken = self.memory.0.lock();
        taken.bytes -= self.bytes.len();
        if let Some(of_client) = taken.of.get_mut(&self.client) {
            *of_client -= self.bytes.len();
            if *of_client == 0 {
                taken.of.remove(&self.client);
            }
        }
    }
}

impl AnswerMemory {
    /// Returns the memory of the large responses in flight.
    pub fn bytes(&self) -> usize {
        self.0.lock().bytes
    }

    /// Returns the budget.
    pub const fn limit_bytes() -> usize {
        MAX_BYTES
    }

    /// Reserves memory for a response on a connection. Returns `None` if responses to its client or to all clients use
    /// too much. A response larger than the budget is sent if there is no other.
    pub fn hold(&self, connection: &Connection, bytes: Bytes) -> Option<Bytes> {
        let client = connection.client();
        let length = bytes.len();
        if length <= SMALL_BYTES {
            return Some(bytes);
        }
        let mut taken = self.0.lock();
        let of_client = taken.of.get(&client).copied().unwrap_or_default();
        let fits = |held: usize, most: usize| held == 0 || held + length <= most;
        if !fits(taken.bytes, MAX_BYTES) || !fits(of_client, MAX_BYTES_OF_CLIENT) {
            return None;
        }
        taken.bytes += length;
        taken.of.insert(client, of_client + length);
        drop(taken);
        Some(Bytes::from_owner(Held { bytes, client, memory: self.clone(), _held: connection.hold(length) }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::connections::Connections;
    use std::net::IpAddr;

    fn connection(number: u8) -> Connection {
        Connections::new().enter(Client::of(IpAddr::from([10, 0, 0, number])))
    }

    #[test]
    fn memory_of_a_response_is_released_with_its_last_slice() {
        let memory = AnswerMemory::default();
        let answer = || Bytes::from(vec![1; MAX_BYTES / 2]);
        let first = memory.hold(&connection(1), answer()).unwrap();
        let mut second = memory.hold(&connection(2), answer()).unwrap();
        assert!(memory.hold(&connection(3), answer()).is_none());
        assert!(memory.hold(&connection(3), Bytes::from(vec![1; SMALL_BYTES])).is_some());
        let slice = second.split_to(10);
        drop(second);
        assert!(memory.hold(&connection(3), answer()).is_none());
        drop(slice);
        assert!(memory.hold(&connection(3), answer()).is_some());
        drop(first);
        // A response larger than the budget is sent alone.
        let largest = memory.hold(&connection(1), Bytes::from(vec![1; MAX_BYTES + 1])).unwrap();
        assert!(memory.hold(&connection(2), answer()).is_none());
        drop(largest);
        assert!(memory.0.lock().of.is_empty() && memory.0.lock().bytes == 0);
    }

    #[test]
    fn a_client_cannot_use_all_memory() {
        let memory = AnswerMemory::default();
        let answer = || Bytes::from(vec![1; MAX_BYTES / 8]);
        let of_one: Vec<_> = (0..8).filter_map(|_| memory.hold(&connection(1), answer())).collect();
        assert_eq!(of_one.len(), 4);
        assert!(memory.hold(&connection(2), answer()).is_some());
    }
}
