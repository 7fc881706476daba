use super::recording::{Message, Recording, Topic, TopicList, TopicSet};
use voxtile::Result;

/// Recordings concatenated in time, such as the parts of a split bag.
///
/// Only one part has open files at a time.
#[derive(Default)]
pub struct Sequence {
    parts: Vec<Part>,
    topics: TopicList,
    wanted: TopicSet,
    at: usize,
    has_begun: bool,
}

struct Part {
    recording: Box<dyn Recording>,
    /// Index in the common topic list of each topic of this part.
    topics: Vec<usize>,
}

impl Sequence {
    /// Appends the next recording in time.
    pub fn push(&mut self, mut recording: Box<dyn Recording>) {
        recording.close_files();
        let topics = recording.topics().iter().map(|topic| {
            // Topics beyond the limit are never selected.
            let index = self.topics.index(&topic.name, &topic.type_name, topic.wire).unwrap_or(usize::MAX);
            self.topics.count(index, topic.messages);
            index
        });
        let topics = topics.collect();
        self.parts.push(Part { recording, topics });
    }
}

impl Recording for Sequence {
    fn format(&self) -> &str {
        self.parts.first().map_or("recording", |part| part.recording.format())
    }

    fn topics(&self) -> &[Topic] {
        &self.topics.topics
    }

    fn begin(&mut self, topics: &[usize]) -> Result<()> {
        self.wanted = TopicSet::of(topics);
        self.at = 0;
        self.has_begun = false;
        Ok(())
    }

    fn next_message(&mut self) -> Result<Option<Message>> {
        while let Some(part) = self.parts.get_mut(self.at) {
            if !self.has_begun {
                let is_wanted =
                    |index: &usize| part.topics.get(*index).is_some_and(|topic| self.wanted.contains(*topic));
                let own: Vec<usize> = (0..part.topics.len()).filter(is_wanted).collect();
                self.has_begun = true;
                part.recording.begin(&own)?;
            }
            let Some(message) = part.recording.next_message()? else {
                // Selecting no topics frees the chunks in memory.
                part.recording.begin(&[])?;
                part.recording.close_files();
                self.at += 1;
                self.has_begun = false;
                continue;
            };
            // Skip topics that were not yet known when the topics were selected.
            if let Some(&topic) = part.topics.get(message.topic) {
                return Ok(Some(Message { topic, ..message }));
            }
        }
        Ok(None)
    }

    fn close_files(&mut self) {
        self.parts.iter_mut().for_each(|part| part.recording.close_files());
    }

    fn remarks(&self) -> Vec<String> {
        self.parts.iter().flat_map(|part| part.recording.remarks()).collect()
    }
}
