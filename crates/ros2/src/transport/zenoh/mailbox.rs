use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, PoisonError};

/// Queue of received messages for one thread, bounded in number and bytes. When it is full, the oldest are dropped:
/// Zenoh's threads never wait.
#[derive(Debug)]
pub struct Mailbox<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
    max_count: usize,
    max_bytes: usize,
}

#[derive(Debug)]
struct State<T> {
    waiting: VecDeque<(T, usize)>,
    bytes: usize,
    is_closed: bool,
}

impl<T> Mailbox<T> {
    pub fn new(max_count: usize, max_bytes: usize) -> Arc<Self> {
        let state = State { waiting: VecDeque::new(), bytes: 0, is_closed: false };
        Arc::new(Self {
            state: Mutex::new(state),
            changed: Condvar::new(),
            max_count: max_count.max(1),
            max_bytes,
        })
    }

    /// Adds an item and returns the number of dropped items. `bytes` must not exceed the limit.
    pub fn put(&self, one: T, bytes: usize) -> usize {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let mut dropped = 0;
        while state.waiting.len() >= self.max_count || state.bytes.saturating_add(bytes) > self.max_bytes {
            let Some((_, oldest_bytes)) = state.waiting.pop_front() else { break };
            state.bytes -= oldest_bytes;
            dropped += 1;
        }
        state.bytes += bytes;
        state.waiting.push_back((one, bytes));
        self.changed.notify_one();
        dropped
    }

    /// Waits for the next item. Returns `None` after the mailbox is closed.
    pub fn take(&self) -> Option<T> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if state.is_closed {
                return None;
            }
            if let Some((one, bytes)) = state.waiting.pop_front() {
                state.bytes -= bytes;
                return Some(one);
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Closes the mailbox, which ends the thread that reads it.
    pub fn close(&self) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).is_closed = true;
        self.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mailbox_is_bounded_in_number_and_bytes() {
        let mailbox = Mailbox::new(3, 100);
        assert_eq!((1..=5).map(|n| mailbox.put(n, 10)).collect::<Vec<_>>(), [0, 0, 0, 1, 1]);
        assert_eq!(mailbox.put(6, 85), 2);
        assert_eq!(mailbox.put(7, 0), 0);
        assert_eq!([mailbox.take(), mailbox.take(), mailbox.take()], [Some(5), Some(6), Some(7)]);
        mailbox.put(8, 100);
        mailbox.close();
        assert_eq!(mailbox.take(), None);
    }
}
