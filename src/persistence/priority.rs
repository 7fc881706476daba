/// Permanently lowers the priority of this thread below that of normal threads. With few cores, writing to disk then
/// uses the time that scans leave, but never stops.
///
/// If the system refuses, the priority is unchanged.
#[cfg(target_os = "linux")]
pub(crate) fn lower_priority() {
    /// Next to a busy thread, the low-priority thread gets a tenth of a core (`sched(7)`: 110 parts of 1024 + 110).
    const NICENESS: i32 = 10;
    // On Linux the nice value applies to the thread, not to the process.
    if let Err(error) = rustix::process::nice(NICENESS) {
        log::debug!("cannot lower the priority of this thread: {error}");
    }
}

/// Other systems have no nice value per thread.
#[cfg(not(target_os = "linux"))]
pub(crate) fn lower_priority() {}
