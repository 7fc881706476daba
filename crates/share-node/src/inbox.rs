use std::collections::{BTreeMap, VecDeque};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Bytes that came under a key.
pub struct Message {
    pub key: String,
    pub bytes: Vec<u8>,
}

/// Messages that wait to be taken in, fair between robots: next comes that of the robot that has taken least time so
/// far, and where there is no room, the robot with most bytes waiting loses its oldest message. Catch-up mends what is
/// lost.
///
/// Robots that nobody has admitted wait together, as one.
#[derive(Default)]
pub struct Inbox {
    state: Mutex<State>,
    has_message: Condvar,
}

#[derive(Default)]
struct State {
    robots: BTreeMap<String, Queue>,
    strangers: Queue,
    bytes: usize,
    /// Of who came last.
    spent: Duration,
}

#[derive(Default)]
struct Queue {
    messages: VecDeque<Message>,
    bytes: usize,
    /// Time that its messages took; no less than that of who came last, so that nobody saves time up.
    spent: Duration,
}

/// Bytes of messages that wait.
const MAX_BYTES: usize = 4 << 20;
/// What a message takes beside its bytes.
const MESSAGE: usize = 128;

impl Inbox {
    /// Puts a message in, at the cost of who has most.
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

    /// The next message, if there is one within a time.
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

    /// Has a robot's messages wait by themselves, or again with those of strangers.
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

    /// Counts the time since a message of a robot was taken.
    pub fn has_spent(&self, robot: &str, since: Instant) {
        self.lock().queue(robot).spent += since.elapsed();
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing here can panic half way.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn queues(&mut self) -> impl Iterator<Item = &mut Queue> {
        self.robots.values_mut().chain([&mut self.strangers])
    }

    fn queue(&mut self, robot: &str) -> &mut Queue {
        match self.robots.get_mut(robot) {
            Some(queue) => queue,
            None => &mut self.strangers,
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
    fn a_flood_of_one_robot_loses_its_own_messages_alone() {
        let inbox = Inbox::default();
        ["a", "flood"].iter().for_each(|robot| inbox.admit(robot, true));
        (0..10).for_each(|_| inbox.put("a", message("a", 1000)));
        (0..1000).for_each(|_| inbox.put("flood", message("flood", 60_000)));
        (0..1000).for_each(|_| inbox.put("stranger", message("stranger", 60_000)));
        assert!(inbox.lock().bytes <= MAX_BYTES);
        let came: Vec<String> =
            std::iter::from_fn(|| inbox.next(Duration::ZERO)).map(|message| message.key).collect();
        assert_eq!(came.iter().filter(|robot| *robot == "a").count(), 10);
        assert!(came.iter().filter(|robot| *robot == "flood").count() > 20);
        assert!(came.iter().filter(|robot| *robot == "stranger").count() > 20);
        assert_eq!(inbox.lock().bytes, 0);
    }

    #[test]
    fn who_takes_long_comes_less_often() {
        let inbox = Inbox::default();
        ["quick", "slow"].iter().for_each(|robot| inbox.admit(robot, true));
        for _ in 0..100 {
            inbox.put("quick", message("quick", 10));
            inbox.put("slow", message("slow", 10));
        }
        let mut came = BTreeMap::<String, usize>::new();
        for _ in 0..101 {
            let robot = inbox.next(Duration::ZERO).unwrap().key;
            let took = Duration::from_millis(if robot == "slow" { 1000 } else { 10 });
            inbox.lock().queue(&robot).spent += took;
            *came.entry(robot).or_default() += 1;
        }
        assert!(came["slow"] <= 2 && came["quick"] >= 99, "{came:?}");
        inbox.admit("slow", false);
        assert!(inbox.next(Duration::ZERO).is_none() || inbox.lock().bytes == 0);
    }
}
