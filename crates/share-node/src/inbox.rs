use std::collections::{BTreeMap, VecDeque};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Payload received under a key.
pub struct Message {
    pub key: String,
    pub bytes: Vec<u8>,
}

/// Queue of received messages, fair between robots. [`next`](Inbox::next) serves the robot with the least processing
/// time. If the queue exceeds `MAX_BYTES`, the robot with the most queued bytes loses its oldest message; catch-up
/// repairs the loss.
///
/// Robots that are not admitted share one queue.
#[derive(Default)]
pub struct Inbox {
    state: Mutex<State>,
    has_message: Condvar,
}

#[derive(Default)]
struct State {
    robots: BTreeMap<String, Queue>,
    unadmitted: Queue,
    bytes: usize,
    /// Processing time of the queue that was served last.
    spent: Duration,
}

#[derive(Default)]
struct Queue {
    messages: VecDeque<Message>,
    bytes: usize,
    /// Time spent on processing its messages. If an empty queue gets a message, its time is raised to that of the queue
    /// served last, so that idle robots accumulate no credit.
    spent: Duration,
}

/// Maximum size of all queued messages.
const MAX_BYTES: usize = 4 << 20;
/// Overhead of a message in addition to its bytes.
const MESSAGE: usize = 128;

impl Inbox {
    /// Queues a message. Drops messages of the longest queue until all fit.
    pub fn put(&self, robot: &str, message: Message) {
        let mut state = self.lock();
        let spent = state.spent;
        let queue = state.queue(robot);
        if queue.messages.is_empty() {
            queue.spent = queue.spent.max(spent);
        }
        queue.bytes += message.size();
        let size = message.size();
        queue.messages.push_back(message);
        state.bytes += size;
        while state.bytes > MAX_BYTES {
            let Some(longest) = state.queues().max_by_key(|queue| queue.bytes) else { break };
            let lost = longest.pop();
            state.bytes -= lost.map_or(0, |message| message.size());
        }
        drop(state);
        self.has_message.notify_one();
    }

    /// Returns the next message, or `None` after `wait`.
    pub fn next(&self, wait: Duration) -> Option<Message> {
        let is_empty = |state: &mut State| state.bytes == 0;
        let (mut state, _) = self
            .has_message
            .wait_timeout_while(self.lock(), wait, is_empty)
            .unwrap_or_else(PoisonError::into_inner);
        let next =
            state.queues().filter(|queue| !queue.messages.is_empty()).min_by_key(|queue| queue.spent)?;
        let (message, spent) = (next.pop()?, next.spent);
        state.bytes -= message.size();
        state.spent = spent;
        Some(message)
    }

    /// Gives a robot its own queue, or removes it with its messages.
    pub fn admit(&self, robot: &str, is_admitted: bool) {
        let mut state = self.lock();
        if is_admitted {
            let spent = state.spent;
            let new = || Queue { spent, ..Queue::default() };
            state.robots.entry(robot.to_owned()).or_insert_with(new);
        } else if let Some(left) = state.robots.remove(robot) {
            state.bytes -= left.bytes;
        }
    }

    /// Adds the time since `since` to the robot's processing time.
    pub fn has_spent(&self, robot: &str, since: Instant) {
        self.lock().queue(robot).spent += since.elapsed();
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // A poisoned lock is ignored: no code that holds it can panic after changing only a part of the state.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn queues(&mut self) -> impl Iterator<Item = &mut Queue> {
        self.robots.values_mut().chain([&mut self.unadmitted])
    }

    fn queue(&mut self, robot: &str) -> &mut Queue {
        match self.robots.get_mut(robot) {
            Some(queue) => queue,
            None => &mut self.unadmitted,
        }
    }
}

impl Queue {
    fn pop(&mut self) -> Option<Message> {
        let message = self.messages.pop_front()?;
        self.bytes -= message.size();
        Some(message)
    }
}

impl Message {
    fn size(&self) -> usize {
        self.bytes.capacity() + self.key.capacity() + MESSAGE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(robot: &str, bytes: usize) -> Message {
        Message { key: robot.to_owned(), bytes: vec![0; bytes] }
    }

    #[test]
    fn a_flooding_robot_loses_only_its_own_messages() {
        let inbox = Inbox::default();
        ["a", "flood"].iter().for_each(|robot| inbox.admit(robot, true));
        (0..10).for_each(|_| inbox.put("a", message("a", 1000)));
        (0..1000).for_each(|_| inbox.put("flood", message("flood", 60_000)));
        (0..1000).for_each(|_| inbox.put("unknown", message("unknown", 60_000)));
        assert!(inbox.lock().bytes <= MAX_BYTES);
        let received: Vec<String> =
            std::iter::from_fn(|| inbox.next(Duration::ZERO)).map(|message| message.key).collect();
        assert_eq!(received.iter().filter(|robot| *robot == "a").count(), 10);
        assert!(received.iter().filter(|robot| *robot == "flood").count() > 20);
        assert!(received.iter().filter(|robot| *robot == "unknown").count() > 20);
        assert_eq!(inbox.lock().bytes, 0);
    }

    #[test]
    fn slow_robots_are_served_less_often() {
        let inbox = Inbox::default();
        ["quick", "slow"].iter().for_each(|robot| inbox.admit(robot, true));
        for _ in 0..100 {
            inbox.put("quick", message("quick", 10));
            inbox.put("slow", message("slow", 10));
        }
        let mut received = BTreeMap::<String, usize>::new();
        for _ in 0..101 {
            let robot = inbox.next(Duration::ZERO).unwrap().key;
            let took = Duration::from_millis(if robot == "slow" { 1000 } else { 10 });
            inbox.lock().queue(&robot).spent += took;
            *received.entry(robot).or_default() += 1;
        }
        assert!(received["slow"] <= 2 && received["quick"] >= 99, "{received:?}");
        inbox.admit("slow", false);
        assert!(inbox.next(Duration::ZERO).is_none() || inbox.lock().bytes == 0);
    }
}
