use crate::corrections::Corrections;
use std::f64::consts::PI;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use voxtile::mapper::KeptSummary;
use voxtile::operations::{NewPoses, OnlineRemap, Remap, Replay};
use voxtile::{MemoryLimit, Point, Stop};
use voxtile_formats::ros::messages::StampedPose;

/// Remapping of a map by a corrected path in a thread of its own, concurrent with its mapper.
///
/// When the remapping has caught up with the flushed scans, it waits for one more flush. Few scans then remain to be
/// replayed while the map is closed.
pub struct Remapping {
    thread: Option<JoinHandle<voxtile::Result<Option<Remapped>>>>,
    stop: Stop,
    has_caught_up: Arc<AtomicBool>,
    flushes: Sender<()>,
    /// Scan that must be durable before the thread continues.
    awaits: Option<u64>,
}

/// Result of the thread.
pub struct Remapped {
    /// Remapping to be finished while the map is closed.
    pub online: OnlineRemap,
    /// Last scan that the path covers, and its corrected sensor position.
    pub last: (u64, Option<Point>),
}

/// Parameters of a remapping.
#[derive(Clone, Copy, Debug)]
pub struct Order {
    /// Last scan that the path corrects. Later scans were mapped after the path was sent, and keep their poses.
    pub last_scan: u64,
    pub tolerance_m: f64,
    pub memory_bytes: usize,
}

/// Rotation in radians up to which a path is ignored: half a degree.
const TOLERANCE: f64 = PI / 360.0;

impl Remapping {
    /// Starts the thread, which remaps the scans up to `last_scan` of the order. That scan must be durable.
    ///
    /// # Errors
    ///
    /// The thread cannot be started.
    pub fn begin(folder: PathBuf, path: Vec<StampedPose>, order: Order) -> std::io::Result<Self> {
        let (stop, has_caught_up) = (Stop::default(), Arc::new(AtomicBool::new(false)));
        let (flushes, flushed) = channel();
        let (thread_stop, caught_up) = (stop.clone(), has_caught_up.clone());
        let work = move || follow(folder, &path, order, thread_stop, &caught_up, &flushed);
        let thread = Some(std::thread::Builder::new().name("remapping".to_owned()).spawn(work)?);
        Ok(Self { thread, stop, has_caught_up, flushes, awaits: None })
    }

    /// Reports the durable scan to the thread. Returns whether the thread waits for a flush.
    pub fn advance(&mut self, scan: u64, durable: u64) -> bool {
        if self.awaits.is_none() && self.has_caught_up.swap(false, Ordering::Relaxed) {
            self.awaits = Some(scan);
        }
        if self.awaits.is_some_and(|awaited| awaited <= durable) {
            self.awaits = None;
            // A failed thread has dropped its receiver.
            let _ = self.flushes.send(());
        }
        self.awaits.is_some()
    }

    /// Returns whether the thread has finished.
    pub fn is_over(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Returns the result; `None` for a path that moves no scan.
    ///
    /// # Errors
    ///
    /// The reason why the path cannot be followed.
    pub fn end(mut self) -> voxtile::Result<Option<Remapped>> {
        let Some(thread) = self.thread.take() else { return Ok(None) };
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}

impl Drop for Remapping {
    /// Stops the remapping. The map is unchanged.
    fn drop(&mut self) {
        // After `end` there is no thread, and the stop flag must remain unset, because the remapping is still to be
        // finished.
        let Some(thread) = self.thread.take() else { return };
        self.stop.set();
        let _ = self.flushes.send(());
        let _ = thread.join();
    }
}

fn follow(
    folder: PathBuf,
    path: &[StampedPose],
    order: Order,
    stop: Stop,
    has_caught_up: &AtomicBool,
    flushed: &Receiver<()>,
) -> voxtile::Result<Option<Remapped>> {
    let scans = KeptSummary::read(&folder)?;
    let found = Corrections::of(scans.scans().iter().filter(|scan| scan.number <= order.last_scan), path)?;
    if found.most_moved_m <= order.tolerance_m && found.most_turned <= TOLERANCE {
        log::debug!("a path of {} poses moves no scan: {} scans match", path.len(), found.named);
        return Ok(None);
    }
    log::info!("remapping: a path moves scans by up to {:.2} m", found.most_moved_m);
    let sensor_m = found.poses.last().map(|(_, pose)| pose.position_m());
    let replay = Replay::default().with_memory(MemoryLimit::Bytes(order.memory_bytes)).with_stop(stop);
    let mut online = OnlineRemap::begin(&scans, &NewPoses::Numbered(found.poses), &Remap::new(replay))?;
    while online.follow(|_| ())? > 0 {}
    has_caught_up.store(true, Ordering::Relaxed);
    // An error means that the remapping was dropped.
    let _ = flushed.recv();
    online.follow(|_| ())?;
    Ok(Some(Remapped { online, last: (order.last_scan, sensor_m) }))
}
