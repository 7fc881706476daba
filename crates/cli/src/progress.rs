use crate::option_names::with_options;
use crate::quiet::is_quiet;
use indicatif::{HumanBytes, ProgressBar, ProgressDrawTarget, ProgressStyle};
use parking_lot::Mutex;
use std::io::{self, Write};
use std::sync::Arc;
use voxtile::mapper::MapStatistics;
use voxtile::scan::Stop;
use voxtile_pipeline::memory::resident_bytes;
use voxtile_pipeline::{Gauge, Unit, Watch};

/// Progress bar on standard error; invisible if standard error is no terminal.
pub struct Progress {
    bar: ProgressBar,
}

/// Returns a `Watch` with progress bars on the terminal.
pub fn at_terminal(stop: Stop) -> Watch {
    let bar = |unit, all: Option<u64>| -> Box<dyn Gauge> {
        let all = all.map(|all| usize::try_from(all).unwrap_or(usize::MAX));
        Box::new(match unit {
            Unit::Scans => Progress::over_scans(all),
            Unit::Tiles => Progress::over_tiles(all.unwrap_or(0)),
            Unit::Bytes => Progress::over_bytes(),
        })
    };
    Watch::new(stop, Arc::new(bar))
}

/// The latest bar, if it still exists.
static SHOWN: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Log output on standard error: writes above the progress bar and replaces field names by options.
pub struct AboveBar;

impl Write for AboveBar {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let line = String::from_utf8_lossy(bytes);
        let write = || io::stderr().write_all(with_options(&line).as_bytes()).map(|()| bytes.len());
        let shown = SHOWN.lock().clone();
        shown.map_or_else(write, |bar| bar.suspend(write))
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

impl Progress {
    pub fn over_scans(scans: Option<usize>) -> Self {
        let (bar, template) = match scans {
            Some(scans) => (
                ProgressBar::new(scans as u64),
                "{bar:30} {pos}/{len} scans  {per_sec:.0}  {msg}  {eta} left",
            ),
            None => (ProgressBar::no_length(), "{spinner} {pos} scans  {per_sec:.0}  {msg}"),
        };
        Self::styled(bar, template)
    }

    pub fn over_tiles(tiles: usize) -> Self {
        Self::styled(ProgressBar::new(tiles as u64), "{bar:30} {pos}/{len} tiles  {eta} left")
    }

    pub fn over_blocks() -> Self {
        Self::styled(ProgressBar::new(0), "{bar:30} {pos}/{len} blocks  {eta} left")
    }

    pub fn over_bytes() -> Self {
        Self::styled(ProgressBar::new(0), "{bar:30} {bytes}/{total_bytes}  {bytes_per_sec}  {eta} left")
    }

    fn styled(bar: ProgressBar, template: &str) -> Self {
        if is_quiet() {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        bar.set_style(style(template));
        *SHOWN.lock() = Some(bar.clone());
        Self { bar }
    }

    /// Sets the number of steps done before this run.
    pub fn pass(&self, done: u64) {
        self.bar.set_position(done);
        self.bar.reset_eta();
    }

    pub fn step(&self) {
        self.bar.inc(1);
    }

    /// Sets the numbers of finished and of all steps.
    pub fn set(&self, done: u64, all: u64) {
        self.bar.set_length(all);
        self.bar.set_position(done);
    }

    /// Prints a line on standard output, above the bar.
    pub fn print(&self, line: &str) {
        // Ignores closed pipes such as `| head`: work continues.
        self.bar.suspend(|| writeln!(std::io::stdout(), "{line}").unwrap_or_default());
    }

    /// Shows the mapper's tiles and memory, after every eighth scan.
    pub fn show(&self, statistics: &dyn Fn() -> MapStatistics) {
        if self.bar.is_hidden() || !self.bar.position().is_multiple_of(8) {
            return;
        }
        let MapStatistics { tiles, cached_tiles, buffered_tiles, stalls, .. } = statistics();
        let memory = resident_bytes().map_or(String::new(), |bytes| format!(", {}", HumanBytes(bytes)));
        let waiting = match buffered_tiles {
            0 => String::new(),
            tiles => format!(", updates waiting for {tiles}"),
        };
        let stalls = match stalls.count {
            0 => String::new(),
            count => format!(", {count} stalls up to {} ms", stalls.worst_us / 1000),
        };
        self.bar.set_message(format!("{tiles} tiles, {cached_tiles} in memory{memory}{waiting}{stalls}"));
    }

    pub fn show_message(&self, message: &'static str) {
        self.bar.set_message(message);
    }
}

impl Gauge for Progress {
    fn pass(&self, done: u64) {
        self.pass(done);
    }

    fn step(&self) {
        self.step();
    }

    fn set(&self, done: u64, all: u64) {
        self.set(done, all);
    }

    fn say(&self, message: &'static str) {
        self.show_message(message);
    }

    fn show(&self, statistics: &dyn Fn() -> MapStatistics) {
        self.show(statistics);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        SHOWN.lock().take_if(|shown| shown.is_finished());
    }
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}
