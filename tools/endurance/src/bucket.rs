use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// A device that moves so many bytes a second, in whichever direction, and no more.
#[derive(Debug)]
pub struct Bucket {
    bytes_per_s: f64,
    /// When the device will be done with all that it was given.
    done: Mutex<Instant>,
}

/// How far the device may be behind before who gave it bytes has to wait: shorter sleeps are not exact.
const SLACK: Duration = Duration::from_millis(2);

impl Bucket {
    /// A device with nothing to do.
    pub fn new(bytes_per_s: f64) -> Self {
        Self { bytes_per_s, done: Mutex::new(Instant::now()) }
    }

    /// Gives the device so many bytes, and waits unless it will be done in an instant.
    pub fn take(&self, bytes: usize) {
        let needed = Duration::from_secs_f64(bytes as f64 / self.bytes_per_s);
        let done = {
            let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
            *done = (*done).max(Instant::now()) + needed;
            *done
        };
        wait_until(done, SLACK);
    }

    /// Waits until the device is done with all that it was given.
    pub fn drain(&self) {
        let done = *self.done.lock().unwrap_or_else(PoisonError::into_inner);
        wait_until(done, Duration::ZERO);
    }
}

fn wait_until(then: Instant, slack: Duration) {
    let ahead = then.saturating_duration_since(Instant::now());
    if ahead > slack {
        thread::sleep(ahead);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_two_threads_give_takes_as_long_as_if_one_did() {
        let bucket = Bucket::new(1e6);
        let begin = Instant::now();
        thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| (0..25).for_each(|_| bucket.take(1_000)));
            }
        });
        bucket.drain();
        // Nothing limits how long a busy machine sleeps.
        assert!(begin.elapsed() >= Duration::from_millis(49), "{:?}", begin.elapsed());
    }

    #[test]
    fn a_device_with_nothing_to_do_saves_nothing_up() {
        let bucket = Bucket::new(1e6);
        thread::sleep(Duration::from_millis(20));
        let begin = Instant::now();
        bucket.take(20_000);
        assert!(begin.elapsed() >= Duration::from_millis(20));
    }
}
