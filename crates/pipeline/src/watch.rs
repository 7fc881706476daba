use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use voxtile::mapper::MapStatistics;
use voxtile::scan::Stop;

/// Unit of progress.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Scans.
    Scans,
    /// Tiles.
    Tiles,
    /// Bytes.
    Bytes,
}

/// Receives the progress of one task. Dropped when the task ends.
pub trait Gauge: Send + Sync {
    /// Sets the number of items done by an earlier run.
    fn pass(&self, done: u64);

    /// Counts one more item.
    fn step(&self);

    /// Sets the number of items done, and of all.
    fn set(&self, done: u64, all: u64);

    /// Shows a message between steps, such as "flushing".
    fn say(&self, message: &'static str);

    /// Shows the statistics of a mapper. Calls `statistics` only if they are displayed.
    fn show(&self, statistics: &dyn Fn() -> MapStatistics);
}

/// Function that creates a gauge for a task, given its unit and the number of items, if known.
pub type MakeGauge = Arc<dyn Fn(Unit, Option<u64>) -> Box<dyn Gauge> + Send + Sync>;

/// Callback with the number of scans or tiles done, and of all (0 if unknown).
pub type Listener = Arc<dyn Fn(u64, u64) + Send + Sync>;

/// Control of a long task by its caller: stops it and receives its progress.
#[derive(Clone)]
pub struct Watch {
    stop: Stop,
    make_gauge: MakeGauge,
}

impl Watch {
    /// Creates a watch that never stops the task and ignores its progress.
    pub fn silent() -> Self {
        Self::of_program(Stop::default(), None)
    }

    /// Creates a watch that reports progress to gauges created by `make_gauge`.
    pub fn new(stop: Stop, make_gauge: MakeGauge) -> Self {
        Self { stop, make_gauge }
    }

    /// Creates a watch that calls a listener after each step.
    pub fn of_program(stop: Stop, listener: Option<Listener>) -> Self {
        let make_gauge = move |_, all: Option<u64>| -> Box<dyn Gauge> {
            let (listener, done) = (listener.clone(), AtomicU64::new(0));
            Box::new(ListenerGauge { listener, done, all: all.unwrap_or(0) })
        };
        Self { stop, make_gauge: Arc::new(make_gauge) }
    }

    /// Returns the stop flag.
    pub fn stop(&self) -> &Stop {
        &self.stop
    }

    /// Creates a gauge for scans.
    pub fn over_scans(&self, scans: Option<usize>) -> Box<dyn Gauge> {
        (self.make_gauge)(Unit::Scans, scans.map(|scans| scans as u64))
    }

    /// Creates a gauge for tiles.
    pub fn over_tiles(&self, tiles: usize) -> Box<dyn Gauge> {
        (self.make_gauge)(Unit::Tiles, Some(tiles as u64))
    }

    /// Creates a gauge for bytes.
    pub fn over_bytes(&self) -> Box<dyn Gauge> {
        (self.make_gauge)(Unit::Bytes, None)
    }
}

impl fmt::Debug for Watch {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Watch").field("stop", &self.stop).finish_non_exhaustive()
    }
}

/// Gauge that calls a listener.
struct ListenerGauge {
    listener: Option<Listener>,
    done: AtomicU64,
    all: u64,
}

impl Gauge for ListenerGauge {
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
