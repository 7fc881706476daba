use std::io;

/// What an operation does, as far as faults go.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Reads,
    Changes,
    NeedsRoom,
}

/// Whether an operation goes.
pub(super) enum Verdict {
    Goes,
    Fails(io::Error),
}
