use std::io;

/// Kind of an operation, as far as faults depend on it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Reads,
    Changes,
    NeedsSpace,
}

/// Outcome of an operation.
pub(super) enum Verdict {
    Succeeds,
    Fails(io::Error),
}
