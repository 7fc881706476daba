use super::bag_topic::kind_of;
use super::messages::MessageKind;
use super::recording::Topic;

/// Maximum number of topics in a hint.
const MAX_NAMED: usize = 10;

/// Returns a hint that names the topics with poses, for recordings without `/tf`.
pub(super) fn topics_with_poses(topics: &[Topic]) -> Option<String> {
    let is_pose = |topic: &&Topic| topic.messages > 0 && kind_of(topic).is_some_and(MessageKind::is_pose);
    let mut found = topics.iter().filter(is_pose).peekable();
    let first = found.peek()?.name.clone();
    let all: Vec<String> = found
        .take(MAX_NAMED)
        .map(|topic| format!("{} ({}, {} messages)", topic.name, topic.type_name, topic.messages))
        .collect();
    Some(format!(
        "there are poses in {}: select their topic, for instance `odometry` {first}, and add `world_frame` if the \
         points are already in the map frame",
        all.join(", ")
    ))
}
