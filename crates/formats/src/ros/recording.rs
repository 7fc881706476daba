use super::message_data::MessageData;
use super::wire::Wire;
use std::collections::HashMap;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use voxtile::Result;

/// A topic of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Its name: `/points`.
    pub name: String,
    /// The type of its messages, as the recording writes it.
    pub type_name: String,
    /// How they are serialised; `None` if it is a way that is not read.
    pub wire: Option<Wire>,
    /// Number of messages, as the recording counts them.
    pub messages: u64,
}

/// A message of a recording.
#[derive(Clone, Debug)]
pub struct Message {
    /// Its topic: an index into [`Recording::topics`].
    pub topic: usize,
    /// When it was recorded, in nanoseconds.
    pub log_ns: i64,
    /// Its bytes.
    pub data: MessageData,
}

/// Messages one at a time, in the order in which they are played.
pub trait Recording: Send {
    /// Name of the format, for people.
    fn format(&self) -> &str;

    /// All topics.
    fn topics(&self) -> &[Topic];

    /// Begins from the start, with the messages of these topics (indices) only.
    ///
    /// # Errors
    ///
    /// A file that cannot be read.
    fn begin(&mut self, topics: &[usize]) -> Result<()>;

    /// The next message. `None` after the last one, and before [`Recording::begin`].
    ///
    /// # Errors
    ///
    /// A file that cannot be read or is invalid. The call after that goes on behind the bad part.
    fn next_message(&mut self) -> Result<Option<Message>>;

    /// Closes files until they are read again: a process may have fewer files open than a bag has parts.
    fn close_files(&mut self);

    /// What a person should know: parts that were cut off, an index that is missing.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }
}

/// Topics as they are found. A topic that several publishers write is one; one of two types is two.
#[derive(Debug, Default)]
pub(super) struct TopicList {
    pub(super) topics: Vec<Topic>,
    /// What they take.
    bytes: usize,
    /// Indices of topics by the hash of what tells one from another. A file may name a topic in each of its connections.
    by_hash: HashMap<u64, Vec<usize>>,
}

/// Some of the topics of a recording. A file may have as many topics as messages.
#[derive(Clone, Debug, Default)]
pub(super) struct TopicSet {
    /// By topic; topics beyond the end are left out.
    is_in: Vec<bool>,
}

impl TopicSet {
    /// The set of these topics (indices); those that no list can hold are left out.
    pub(super) fn of(topics: &[usize]) -> Self {
        let last = topics.iter().filter(|topic| **topic < MAX_TOPIC_BYTES).max();
        let mut is_in = vec![false; last.map_or(0, |last| last + 1)];
        for &topic in topics {
            if let Some(is_in) = is_in.get_mut(topic) {
                *is_in = true;
            }
        }
        Self { is_in }
    }

    pub(super) fn contains(&self, topic: usize) -> bool {
        self.is_in.get(topic).copied().unwrap_or(false)
    }

    #[cfg(feature = "sqlite")]
    pub(super) fn is_empty(&self) -> bool {
        self.is_in.is_empty()
    }
}

/// Memory for topics: some ten thousand. Others are not read.
const MAX_TOPIC_BYTES: usize = 1 << 20;

impl TopicList {
    /// The index of a topic, which is appended if it is new; `None` if there are too many.
    pub(super) fn index(&mut self, name: &str, type_name: &str, wire: Option<Wire>) -> Option<usize> {
        let mut hasher = DefaultHasher::new();
        (name, type_name, wire).hash(&mut hasher);
        let hash = hasher.finish();
        let is_it = |topic: &Topic| topic.name == name && topic.type_name == type_name && topic.wire == wire;
        let mut same = self.by_hash.get(&hash).into_iter().flatten();
        if let Some(&index) = same.find(|index| self.topics.get(**index).is_some_and(is_it)) {
            return Some(index);
        }
        let more = size_of::<Topic>().saturating_add(name.len()).saturating_add(type_name.len());
        let bytes = self.bytes.saturating_add(more);
        if bytes > MAX_TOPIC_BYTES {
            return None;
        }
        self.bytes = bytes;
        let index = self.topics.len();
        self.by_hash.entry(hash).or_default().push(index);
        self.topics.push(Topic { name: name.to_owned(), type_name: type_name.to_owned(), wire, messages: 0 });
        Some(index)
    }

    /// Counts messages of a topic.
    pub(super) fn count(&mut self, index: usize, messages: u64) {
        if let Some(topic) = self.topics.get_mut(index) {
            topic.messages = topic.messages.saturating_add(messages);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    /// Each name was once compared with all that were kept.
    #[test]
    fn many_topics_take_time_as_their_number() {
        let (mut topics, start) = (TopicList::default(), Instant::now());
        let mut kept = 0;
        for round in 0..2 {
            for k in 0..100_000 {
                let index = topics.index(&format!("/t{k}"), "std_msgs/String", Some(Wire::Ros1));
                kept += usize::from(round == 0 && index.is_some());
                assert_eq!(index, (k < kept).then_some(k));
            }
        }
        assert!((5000..20_000).contains(&kept), "{kept}");
        assert_ne!(topics.index("/t0", "std_msgs/Empty", Some(Wire::Ros1)), Some(0));
        assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
        let some = TopicSet::of(&[3, 1, usize::MAX]);
        assert_eq!(
            [0, 1, 2, 3, 4, usize::MAX].map(|topic| some.contains(topic)),
            [false, true, false, true, false, false]
        );
    }
}
