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

/// A map that is mapped again beside its mapper, by a corrected path, in a thread of its own.
///
/// Once it has caught up with what was flushed it waits for one more flush, so that little is left to do for the time
/// in which the map is closed.
pub struct Remapping {
    thread: Option<JoinHandle<voxtile::Result<Option<Remapped>>>>,
    stop: Stop,
    has_caught_up: Arc<AtomicBool>,
    flushes: Sender<()>,
    /// The scan that has to be durable before the thread goes on.
    awaits: Option<u64>,
}

/// What a thread has made.
pub struct Remapped {
    /// To be finished while the map is closed.
    pub beside: OnlineRemap,
    /// The last scan that a path was about, and where the sensor was then, as is known now.
    pub last: (u64, Option<Point>),
}

/// What moves scans no farther is no correction.
#[derive(Clone, Copy, Debug)]
pub struct Order {
    /// Scans after this one keep their poses: they came after the path.
    pub last_scan: u64,
    pub tolerance_m: f64,
    pub memory_bytes: usize,
}

/// By which angle scans turn that are no correction: half a degree.
const TOLERANCE: f64 = PI / 360.0;

impl Remapping {
    /// Begins with the scans up to one that is durable.
    ///
    /// # Errors
    ///
    /// No threads.
    pub fn begin(folder: PathBuf, path: Vec<StampedPose>, order: Order) -> std::io::Result<Self> {
        let (stop, has_caught_up) = (Stop::default(), Arc::new(AtomicBool::new(false)));
        let (flushes, flushed) = channel();
        let (its_stop, tells) = (stop.clone(), has_caught_up.clone());
        let work = move || follow(folder, &path, order, its_stop, &tells, &flushed);
        let thread = Some(std::thread::Builder::new().name("remapping".to_owned()).spawn(work)?);
        Ok(Self { thread, stop, has_caught_up, flushes, awaits: None })
    }

    /// Tells the thread what is durable. Returns whether it waits for a flush.
    pub fn advance(&mut self, scan: u64, durable: u64) -> bool {
        if self.awaits.is_none() && self.has_caught_up.swap(false, Ordering::Relaxed) {
            self.awaits = Some(scan);
        }
        if self.awaits.is_some_and(|awaited| awaited <= durable) {
            self.awaits = None;
            // A thread that has failed listens no more.
            let _ = self.flushes.send(());
        }
        self.awaits.is_some()
    }

    /// Whether the thread has done what can be done beside the mapper.
    pub fn is_over(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// What it has made; `None` for a path that moves nothing.
    ///
    /// # Errors
    ///
    /// Why the path cannot be followed.
    pub fn end(mut self) -> voxtile::Result<Option<Remapped>> {
        let Some(thread) = self.thread.take() else { return Ok(None) };
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}

impl Drop for Remapping {
    /// Gives it up; the map stays as it is.
    fn drop(&mut self) {
        // What has ended goes on to be finished, and is not to stop.
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
        log::debug!("a path of {} poses changes nothing: it names {} scans", path.len(), found.named);
        return Ok(None);
    }
    log::info!("remapping beside the mapper: a path moves scans, by {:.2} m at most", found.most_moved_m);
    let sensor_m = found.poses.last().map(|(_, pose)| pose.position_m());
    let rework = Replay::default().with_memory(MemoryLimit::Bytes(order.memory_bytes)).with_stop(stop);
    let mut beside = OnlineRemap::begin(&scans, &NewPoses::Numbered(found.poses), &Remap::new(rework))?;
    while beside.follow(|_| ())? > 0 {}
    has_caught_up.store(true, Ordering::Relaxed);
    // An error means that nobody waits for the map any more.
    let _ = flushed.recv();
    beside.follow(|_| ())?;
    Ok(Some(Remapped { beside, last: (order.last_scan, sensor_m) }))
}
