/// Action if clouds arrive faster than they are mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum WhenBehind {
    /// Wait for free memory; clouds that the transport drops meanwhile are not counted.
    Wait,
    /// Drop the oldest waiting cloud.
    DropOldest,
    /// While the queue is over half full, skip every second cloud of a topic; if it is full, drop the oldest.
    Thin,
}
