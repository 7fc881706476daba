/// Lets all threads of normal priority go before this one, for good. On a computer with few cores, what is written to
/// disk beside the mapper then takes the time that scans leave; it never comes to a standstill.
///
/// A system that refuses leaves the thread as it is.
#[cfg(target_os = "linux")]
pub(crate) fn give_way() {
    /// Beside a thread that never waits, a tenth of a core is left (`sched(7)`: 110 parts of 1024 + 110).
    const NICENESS: i32 = 10;
    // The niceness of Linux is that of the thread, not of the process.
    if let Err(error) = rustix::process::nice(NICENESS) {
        log::debug!("no lower priority for this thread: {error}");
    }
}

/// Other systems have no niceness of threads.
#[cfg(not(target_os = "linux"))]
pub(crate) fn give_way() {}
