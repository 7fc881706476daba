use std::str::FromStr;
use std::time::{Duration, Instant};

/// When a build flushes the map, which makes the inserted scans durable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FlushEvery {
    /// After this number of scans.
    Scans(u64),
    /// After this time, while scans are still being inserted.
    Time(Duration),
    /// Only at the end of the build.
    End,
}

impl FromStr for FlushEvery {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "must be a number of scans (25), seconds (60s) or end".to_owned();
        if text == "end" {
            return Ok(Self::End);
        }
        if let Some(seconds) = text.strip_suffix('s') {
            let seconds: f64 = seconds.parse().map_err(|_| wrong())?;
            return Duration::try_from_secs_f64(seconds).map(Self::Time).map_err(|_| wrong());
        }
        match text.parse() {
            Ok(0) | Err(_) => Err(wrong()),
            Ok(scans) => Ok(Self::Scans(scans)),
        }
    }
}

/// Schedule of flushes.
pub struct FlushSchedule {
    every: FlushEvery,
    scans: u64,
    since: Instant,
}

impl FlushSchedule {
    /// Creates a schedule that starts now.
    pub fn new(every: FlushEvery) -> Self {
        Self { every, scans: 0, since: Instant::now() }
    }

    /// Counts inserted scans and returns whether to flush now.
    pub fn is_due(&mut self, scans: usize) -> bool {
        self.scans += scans as u64;
        match self.every {
            FlushEvery::Scans(scans) => self.scans >= scans,
            FlushEvery::Time(time) => self.since.elapsed() >= time,
            FlushEvery::End => false,
        }
    }

    /// Returns how many scans may be inserted before the next call of [`FlushSchedule::is_due`].
    pub fn scans_until_due(&self) -> usize {
        match self.every {
            FlushEvery::Scans(scans) => {
                usize::try_from(scans.saturating_sub(self.scans)).unwrap_or(usize::MAX)
            }
            FlushEvery::Time(_) | FlushEvery::End => usize::MAX,
        }
    }

    /// Returns whether to flush now while the input is idle.
    pub fn is_due_waiting(&self) -> bool {
        match self.every {
            FlushEvery::Time(time) => self.scans > 0 && self.since.elapsed() >= time,
            FlushEvery::Scans(_) | FlushEvery::End => false,
        }
    }

    /// Returns whether the schedule is by time, which permits a background flush. A flush after a number of scans must
    /// contain exactly these scans.
    pub fn is_by_time(&self) -> bool {
        matches!(self.every, FlushEvery::Time(_))
    }

    /// Records that the map was flushed.
    pub fn flushed(&mut self) {
        (self.scans, self.since) = (0, Instant::now());
    }
}
