use crate::scan_reader::{Read, ReadScan};
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use voxtile::Error;

/// Policy for scans that arrive faster than they can be inserted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WhenBehind {
    /// The input waits.
    #[default]
    Wait,
    /// The oldest queued scan is dropped.
    DropOldest,
    /// While the queue is more than half full, every second scan is dropped; when it is full, as
    /// [`DropOldest`](Self::DropOldest).
    Thin,
}

/// Bounded queue of scans to insert, oldest first.
///
/// The fingerprint of a dropped scan remains in the queue, because the map's record of the input counts all scans.
pub struct ScanQueue {
    waiting: Mutex<Waiting>,
    arrived: Condvar,
    /// Signals free space or the closing of the queue.
    has_room: Condvar,
    capacity: usize,
    when_behind: WhenBehind,
}

#[derive(Default)]
struct Waiting {
    reads: VecDeque<voxtile::Result<Read>>,
    scans: usize,
    was_thinned: bool,
    /// Whether the receiver is gone.
    is_closed: bool,
}

impl ScanQueue {
    /// Default capacity if the input does not wait.
    pub const MAX_SCANS: usize = 8;

    /// Creates a queue with this capacity.
    pub fn new(when_behind: WhenBehind, capacity: usize) -> Self {
        let (arrived, has_room) = (Condvar::new(), Condvar::new());
        Self { waiting: Mutex::default(), arrived, has_room, capacity, when_behind }
    }

    /// Adds the result of a read. If the input is to wait, blocks until there is space. Returns `false` if the queue is
    /// closed.
    pub fn push(&self, read: voxtile::Result<Read>) -> bool {
        let mut waiting = self.lock();
        match read {
            Ok(Read::Scan(scan)) if self.when_behind == WhenBehind::Wait => {
                let is_full = |waiting: &mut Waiting| waiting.scans >= self.capacity && !waiting.is_closed;
                waiting = self.has_room.wait_while(waiting, is_full).unwrap_or_else(PoisonError::into_inner);
                waiting.scans += 1;
                waiting.reads.push_back(Ok(Read::Scan(scan)));
            }
            Ok(Read::Scan(scan)) => waiting.push_scan(scan, self.when_behind, self.capacity),
            other => waiting.reads.push_back(other),
        }
        self.arrived.notify_all();
        !waiting.is_closed
    }

    /// Returns the oldest result of a read, or `None` if there is none within `patience`.
    pub fn take(&self, patience: Duration) -> Option<voxtile::Result<Read>> {
        let waiting = self.lock();
        let waited = self.arrived.wait_timeout_while(waiting, patience, |waiting| waiting.reads.is_empty());
        let (mut waiting, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let read = waiting.reads.pop_front()?;
        waiting.scans -= usize::from(matches!(read, Ok(Read::Scan(_))));
        self.has_room.notify_all();
        Some(read)
    }

    /// Closes the queue: the receiver takes no more.
    pub fn close(&self) {
        self.lock().is_closed = true;
        self.has_room.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Waiting {
    fn push_scan(&mut self, scan: ReadScan, when_behind: WhenBehind, capacity: usize) {
        if when_behind == WhenBehind::Thin {
            self.was_thinned = !self.was_thinned && 2 * self.scans > capacity;
            if self.was_thinned {
                return self.reads.push_back(Ok(Read::LeftOut(scan.fingerprint)));
            }
        }
        if self.scans >= capacity
            && let Some(oldest) = self.reads.iter_mut().find(|read| matches!(read, Ok(Read::Scan(_))))
            && let Ok(Read::Scan(ReadScan { fingerprint, .. })) = oldest
        {
            *oldest = Ok(Read::LeftOut(*fingerprint));
            self.scans -= 1;
        }
        self.scans += 1;
        self.reads.push_back(Ok(Read::Scan(scan)));
    }
}

/// Returns whether no result of a read follows this one.
pub fn is_last(read: &Result<Read, Error>) -> bool {
    matches!(read, Ok(Read::End | Read::Stopped) | Err(_))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry3;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use voxtile_formats::{PointStore, ScanFingerprint, StoredScan};

    fn scan(number: usize) -> ReadScan {
        let mut points_in_sensor = PointStore::default();
        points_in_sensor.begin(false);
        points_in_sensor.push([number as f64, 0.0, 0.0], 0.0).unwrap();
        let world_from_sensor = Isometry3::identity().into();
        let scan =
            StoredScan { name: number.to_string(), stamp_ns: None, points_in_sensor, world_from_sensor };
        let fingerprint = ScanFingerprint::of(&scan).unwrap();
        ReadScan { scan, fingerprint }
    }

    /// Returns the numbers of the scans to insert after this many arrived, and the number of dropped scans.
    fn after(scans: usize, when_behind: WhenBehind) -> (Vec<usize>, usize) {
        let queue = ScanQueue::new(when_behind, ScanQueue::MAX_SCANS);
        let fingerprints: Vec<String> =
            (0..scans).map(|number| scan(number).fingerprint.scan_text()).collect();
        assert!((0..scans).all(|number| queue.push(Ok(Read::Scan(scan(number))))));
        assert!(queue.push(Ok(Read::End)));
        let (mut mapped, mut left_out, mut seen) = (Vec::new(), 0, Vec::new());
        loop {
            match queue.take(Duration::ZERO) {
                Some(Ok(Read::Scan(scan))) => {
                    mapped.push(seen.len());
                    seen.push(scan.fingerprint.scan_text());
                }
                Some(Ok(Read::LeftOut(fingerprint))) => {
                    left_out += 1;
                    seen.push(fingerprint.scan_text());
                }
                Some(Ok(Read::End)) => break,
                _ => panic!("the queue contains only scans and the end"),
            }
        }
        assert_eq!(seen, fingerprints, "the queue returns the fingerprints of all scans in order");
        assert!(queue.take(Duration::ZERO).is_none());
        (mapped, left_out)
    }

    #[test]
    fn oldest_scans_are_dropped_but_keep_their_fingerprints() {
        assert_eq!(after(8, WhenBehind::DropOldest), ((0..8).collect(), 0));
        assert_eq!(after(20, WhenBehind::DropOldest), ((12..20).collect(), 12));
    }

    #[test]
    fn every_second_scan_is_dropped_while_the_queue_is_half_full() {
        assert_eq!(after(5, WhenBehind::Thin), ((0..5).collect(), 0));
        assert_eq!(after(11, WhenBehind::Thin), (vec![0, 1, 2, 3, 4, 6, 8, 10], 3));
        let (mapped, left_out) = after(100, WhenBehind::Thin);
        assert_eq!((mapped.len(), left_out), (8, 92));
    }

    #[test]
    fn closed_queues_reject_scans() {
        for when_behind in [WhenBehind::Wait, WhenBehind::DropOldest, WhenBehind::Thin] {
            let queue = ScanQueue::new(when_behind, 1);
            assert!(queue.push(Ok(Read::Scan(scan(0)))));
            queue.close();
            assert!(!queue.push(Ok(Read::Scan(scan(1)))));
        }
    }

    #[test]
    fn waiting_inputs_block_until_space_or_close() {
        let queue = ScanQueue::new(WhenBehind::Wait, 2);
        let pushed = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            let input = scope.spawn(|| {
                // Without blocking, the queue would be filled forever.
                while pushed.load(Ordering::SeqCst) < 100 && queue.push(Ok(Read::Scan(scan(0)))) {
                    pushed.fetch_add(1, Ordering::SeqCst);
                }
            });
            for taken in 0..5 {
                let read = queue.take(Duration::from_secs(60));
                assert!(matches!(read, Some(Ok(Read::Scan(_)))));
                assert!(pushed.load(Ordering::SeqCst) <= taken + 3);
            }
            queue.close();
            input.join().unwrap();
        });
        assert!((5..=8).contains(&pushed.into_inner()));
    }
}
