/// How samples of a topic are kept and sent. Always the last ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Qos {
    /// Reliable, or best effort.
    pub is_reliable: bool,
    /// Transient local: who comes late gets the last ones too. Otherwise volatile.
    pub is_latched: bool,
    /// How many are kept.
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
