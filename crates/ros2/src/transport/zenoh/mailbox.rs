use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, PoisonError};

/// What came and waits for its thread: so many of so many bytes, and the oldest go first. Zenoh's threads never wait.
#[derive(Debug)]
pub struct Mailbox<T> {
    state: Mutex<State<T>>,
    changed: Condvar,
    most: usize,
    most_bytes: usize,
}

#[derive(Debug)]
struct State<T> {
    waiting: VecDeque<(T, usize)>,
    bytes: usize,
    is_closed: bool,
}

impl<T> Mailbox<T> {
    pub fn new(most: usize, most_bytes: usize) -> Arc<Self> {
        let state = State { waiting: VecDeque::new(), bytes: 0, is_closed: false };
        Arc::new(Self { state: Mutex::new(state), changed: Condvar::new(), most: most.max(1), most_bytes })
    }

    /// Puts one of so many bytes in and returns how many others had to go; it must fit alone.
    pub fn put(&self, one: T, bytes: usize) -> usize {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let mut gone = 0;
        while state.waiting.len() >= self.most || state.bytes.saturating_add(bytes) > self.most_bytes {
            let Some((_, its_bytes)) = state.waiting.pop_front() else { break };
            state.bytes -= its_bytes;
            gone += 1;
        }
        state.bytes += bytes;
        state.waiting.push_back((one, bytes));
        self.changed.notify_one();
        gone
    }

    /// Waits for the next one; none after it was closed.
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

    /// Ends the thread that takes.
    pub fn close(&self) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).is_closed = true;
        self.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_bounded_in_number_and_bytes() {
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
