//! What `--quiet` leaves out: progress bars and summaries. Answers, JSON and errors are printed.

use std::io::{Write, sink, stdout};
use std::sync::atomic::{AtomicBool, Ordering};

static IS_QUIET: AtomicBool = AtomicBool::new(false);

/// Prints no progress bars and summaries from here on.
pub fn be_quiet() {
    IS_QUIET.store(true, Ordering::Relaxed);
}

/// Whether progress bars and summaries are left out.
pub fn is_quiet() -> bool {
    IS_QUIET.load(Ordering::Relaxed)
}

/// Standard output for the summary of a command whose result is elsewhere; nothing if it is quiet, unless the summary
/// `is_asked_for`, as JSON is.
pub fn summary_out(is_asked_for: bool) -> Box<dyn Write> {
    if is_asked_for || !is_quiet() { Box::new(stdout().lock()) } else { Box::new(sink()) }
}
