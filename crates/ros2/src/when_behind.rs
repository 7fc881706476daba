/// What becomes of clouds that come faster than they can be mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum WhenBehind {
    /// Readers wait for room; what DDS cannot keep meanwhile is lost unseen.
    Wait,
    /// The oldest cloud that waits makes room.
    DropOldest,
    /// While the queue is over half full, every second cloud of a topic is left out; then as `drop-oldest`.
    Thin,
}
