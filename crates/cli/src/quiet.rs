//! `--quiet` suppresses progress bars and summaries. Results, JSON and errors are still printed.

use std::io::{Write, sink, stdout};
use std::sync::atomic::{AtomicBool, Ordering};

static IS_QUIET: AtomicBool = AtomicBool::new(false);

/// Suppresses progress bars and summaries.
pub fn be_quiet() {
    IS_QUIET.store(true, Ordering::Relaxed);
}

/// Returns whether progress bars and summaries are suppressed.
pub fn is_quiet() -> bool {
    IS_QUIET.load(Ordering::Relaxed)
}

/// Returns standard output, or a sink with `--quiet`. With `is_requested`, as for JSON, returns standard output in any
/// case.
pub fn summary_out(is_requested: bool) -> Box<dyn Write> {
    if is_requested || !is_quiet() { Box::new(stdout().lock()) } else { Box::new(sink()) }
}
