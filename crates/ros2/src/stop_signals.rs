use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use voxtile::Stop;

/// As shells tell that a signal has ended a process.
const INTERRUPTED: i32 = 130;

/// SIGINT and SIGTERM ask to stop. A second one of the same kind ends the process at once: `ros2 launch` sends the
/// other kind by itself when the last flush takes long.
///
/// # Errors
///
/// The system refuses.
pub fn catch() -> std::io::Result<Stop> {
    let stop = Stop::default();
    for signal in [SIGINT, SIGTERM] {
        let came = Arc::new(AtomicBool::new(false));
        flag::register_conditional_shutdown(signal, INTERRUPTED, came.clone())?;
        flag::register(signal, came)?;
        flag::register(signal, stop.flag())?;
    }
    Ok(stop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use signal_hook::low_level::raise;

    #[test]
    fn the_signal_of_a_launch_file_behind_that_of_a_person_ends_no_flush() {
        let stop = catch().unwrap();
        assert!(!stop.is_set());
        // Would one end the process, the tests would not go on.
        for signal in [SIGINT, SIGTERM] {
            raise(signal).unwrap();
            assert!(stop.is_set());
        }
    }
}
