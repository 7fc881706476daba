use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// A simulated device that transfers `bytes_per_s`, reads and writes together.
#[derive(Debug)]
pub struct Bucket {
    bytes_per_s: f64,
    /// Time at which all requested transfers are complete.
    done: Mutex<Instant>,
}

/// Delay below which [`Bucket::take`] does not wait: shorter sleeps are inexact.
const SLACK: Duration = Duration::from_millis(2);

impl Bucket {
    /// Creates an idle device.
    pub fn new(bytes_per_s: f64) -> Self {
        Self { bytes_per_s, done: Mutex::new(Instant::now()) }
    }

    /// Transfers bytes, and waits if the device is more than [`SLACK`] behind.
    pub fn take(&self, bytes: usize) {
        self.occupy(Duration::from_secs_f64(bytes as f64 / self.bytes_per_s));
    }

    /// Keeps the device busy, and waits if it is more than [`SLACK`] behind.
    pub fn occupy(&self, needed: Duration) {
        let done = {
            let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
            *done = (*done).max(Instant::now()) + needed;
            *done
        };
        wait_until(done, SLACK);
    }

    /// Waits until all transfers are complete.
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
    fn two_threads_share_the_speed() {
        let bucket = Bucket::new(1e6);
        let begin = Instant::now();
        thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| (0..25).for_each(|_| bucket.take(1_000)));
            }
        });
        bucket.drain();
        // A busy machine may sleep longer.
        assert!(begin.elapsed() >= Duration::from_millis(49), "{:?}", begin.elapsed());
    }

    #[test]
    fn idle_time_is_not_saved_up() {
        let bucket = Bucket::new(1e6);
        thread::sleep(Duration::from_millis(20));
        let begin = Instant::now();
        bucket.take(20_000);
        assert!(begin.elapsed() >= Duration::from_millis(20));
    }
}
