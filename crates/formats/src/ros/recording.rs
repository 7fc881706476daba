use super::message_data::MessageData;
use super::wire::Wire;
use std::collections::HashMap;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use voxtile::Result;

/// Topic of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Name, such as `/points`.
    pub name: String,
    /// Message type, as spelled in the recording.
    pub type_name: String,
    /// Serialization of the messages; `None` if it is not supported.
    pub wire: Option<Wire>,
    /// Number of messages according to the recording.
    pub messages: u64,
}

/// Message of a recording.
#[derive(Clone, Debug)]
pub struct Message {
    /// Index of its topic in [`Recording::topics`].
    pub topic: usize,
    /// Recording time, in nanoseconds.
    pub log_ns: i64,
    /// Serialized message.
    pub data: MessageData,
}

/// Source of messages in playback order.
pub trait Recording: Send {
    /// Returns the display name of the format.
    fn format(&self) -> &str;

    /// Returns all topics.
    fn topics(&self) -> &[Topic];

    /// Restarts reading at the beginning. Only messages of these topics (by index) are returned.
    ///
    /// # Errors
    ///
    /// A file cannot be read.
    fn begin(&mut self, topics: &[usize]) -> Result<()>;

    /// Returns the next message, or `None` after the last one and before [`Recording::begin`].
    ///
    /// # Errors
    ///
    /// A file cannot be read or is invalid. The next call continues after the damaged part.
    fn next_message(&mut self) -> Result<Option<Message>>;

    /// Closes files until they are read again. A split bag may have more parts than a process may have open files.
    fn close_files(&mut self);

    /// Returns remarks for the user, for instance on truncated parts or a missing index.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }
}

/// List of distinct topics. Several publishers of a topic share an entry; a name with two message types has two
/// entries.
#[derive(Debug, Default)]
pub(super) struct TopicList {
    pub(super) topics: Vec<Topic>,
    /// Memory used by the topics.
    bytes: usize,
    /// Topic indices by the hash of name, type and serialization. A file may repeat a topic in each of its connections.
    by_hash: HashMap<u64, Vec<usize>>,
}

/// Set of topics of a recording. A file may have as many topics as messages.
#[derive(Clone, Debug, Default)]
pub(super) struct TopicSet {
    /// Membership by topic index. Indices beyond the end are not in the set.
    is_in: Vec<bool>,
}

impl TopicSet {
    /// Creates a set from topic indices. Indices beyond the limit of a list are ignored.
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

/// Memory limit for topics, enough for about ten thousand. Further topics are skipped.
const MAX_TOPIC_BYTES: usize = 1 << 20;

impl TopicList {
    /// Returns the index of a topic, adding it if it is new. Returns `None` if there are too many topics.
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

    /// Adds to the number of messages of a topic.
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

    /// Guards against comparing each name with all others.
    #[test]
    fn adding_many_topics_takes_linear_time() {
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
