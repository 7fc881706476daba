use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use voxtile::Stop;

/// Exit code after SIGINT, as shells report it.
const INTERRUPTED: i32 = 130;

/// Catches SIGINT and SIGTERM as requests to stop. A second signal of the same kind ends the process at once. `ros2
/// launch` sends SIGTERM after SIGINT if the last flush takes long, so a different kind must not.
///
/// # Errors
///
/// The handlers cannot be installed.
pub fn catch() -> std::io::Result<Stop> {
    let stop = Stop::default();
    for signal in [SIGINT, SIGTERM] {
        let received = Arc::new(AtomicBool::new(false));
        flag::register_conditional_shutdown(signal, INTERRUPTED, received.clone())?;
        flag::register(signal, received)?;
        flag::register(signal, stop.flag())?;
    }
    Ok(stop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use signal_hook::low_level::raise;

    #[test]
    fn sigterm_after_sigint_does_not_interrupt_the_flush() {
        let stop = catch().unwrap();
        assert!(!stop.is_set());
        // If a signal ended the process, the test would fail.
        for signal in [SIGINT, SIGTERM] {
            raise(signal).unwrap();
            assert!(stop.is_set());
        }
    }
}
