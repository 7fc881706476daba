/// Quality of service of a topic. The history is always keep-last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Qos {
    /// Reliable if true, otherwise best effort.
    pub is_reliable: bool,
    /// Transient local if true: late subscribers get the last messages. Otherwise volatile.
    pub is_latched: bool,
    /// Number of messages kept.
    pub depth: usize,
}

impl Qos {
    pub const fn best_effort(depth: usize) -> Self {
        Self { is_reliable: false, is_latched: false, depth }
    }

    pub const fn reliable(depth: usize) -> Self {
        Self { is_reliable: true, is_latched: false, depth }
    }

    pub const fn latched(depth: usize) -> Self {
        Self { is_reliable: true, is_latched: true, depth }
    }
}
