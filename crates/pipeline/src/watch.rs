use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use voxtile::mapper::MapStatistics;
use voxtile::scan::Stop;

/// What long work is counted in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Scans.
    Scans,
    /// Tiles.
    Tiles,
    /// Bytes.
    Bytes,
}

/// Receives the progress of one piece of work. Dropped when the work ends.
pub trait Gauge: Send + Sync {
    /// Sets how many were done by an earlier run.
    fn pass(&self, done: u64);

    /// One more is done.
    fn step(&self);

    /// So many of all are done.
    fn set(&self, done: u64, all: u64);

    /// Shows a message between steps, such as "flushing".
    fn say(&self, message: &'static str);

    /// Shows what a mapper holds. Calls `statistics` only if it is displayed.
    fn show(&self, statistics: &dyn Fn() -> MapStatistics);
}

/// Makes a gauge for some work: its unit, and how many there are, where that is known.
pub type MakeGauge = Arc<dyn Fn(Unit, Option<u64>) -> Box<dyn Gauge> + Send + Sync>;

/// Hears how many scans or tiles are done, and of how many; 0 where that is not known.
pub type Listener = Arc<dyn Fn(u64, u64) + Send + Sync>;

/// The caller's side of long work: stops it and receives its progress.
#[derive(Clone)]
pub struct Watch {
    stop: Stop,
    make_gauge: MakeGauge,
}

impl Watch {
    /// Runs to the end and reports no progress.
    pub fn nobody() -> Self {
        Self::of_program(Stop::default(), None)
    }

    /// Reports progress to gauges that `make_gauge` makes.
    pub fn new(stop: Stop, make_gauge: MakeGauge) -> Self {
        Self { stop, make_gauge }
    }

    /// Calls a listener after each step.
    pub fn of_program(stop: Stop, listener: Option<Listener>) -> Self {
        let make_gauge = move |_, all: Option<u64>| -> Box<dyn Gauge> {
            let (listener, done) = (listener.clone(), AtomicU64::new(0));
            Box::new(Heard { listener, done, all: all.unwrap_or(0) })
        };
        Self { stop, make_gauge: Arc::new(make_gauge) }
    }

    /// Whether to stop.
    pub fn stop(&self) -> &Stop {
        &self.stop
    }

    /// A gauge over scans.
    pub fn over_scans(&self, scans: Option<usize>) -> Box<dyn Gauge> {
        (self.make_gauge)(Unit::Scans, scans.map(|scans| scans as u64))
    }

    /// A gauge over tiles.
    pub fn over_tiles(&self, tiles: usize) -> Box<dyn Gauge> {
        (self.make_gauge)(Unit::Tiles, Some(tiles as u64))
    }

    /// A gauge over bytes.
    pub fn over_bytes(&self) -> Box<dyn Gauge> {
        (self.make_gauge)(Unit::Bytes, None)
    }
}

impl fmt::Debug for Watch {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Watch").field("stop", &self.stop).finish_non_exhaustive()
    }
}

/// Steps that a program hears of.
struct Heard {
    listener: Option<Listener>,
    done: AtomicU64,
    all: u64,
}

impl Gauge for Heard {
    fn pass(&self, done: u64) {
        self.done.store(done, Relaxed);
    }

    fn step(&self) {
        let done = self.done.fetch_add(1, Relaxed) + 1;
        if let Some(listener) = &self.listener {
            listener(done, self.all);
        }
    }

    fn set(&self, done: u64, _: u64) {
        self.done.store(done, Relaxed);
    }

    fn say(&self, _: &'static str) {}

    fn show(&self, _: &dyn Fn() -> MapStatistics) {}
}
