use std::str::FromStr;
use std::time::{Duration, Instant};

/// How often a build makes durable what it mapped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FlushEvery {
    /// After this number of scans.
    Scans(u64),
    /// After this time, while scans are still inserted.
    Time(Duration),
    /// Only at the end.
    End,
}

impl FromStr for FlushEvery {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "neither a number of scans (25), nor seconds (60s), nor end".to_owned();
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

/// When the next flush is due.
pub struct FlushSchedule {
    every: FlushEvery,
    scans: u64,
    since: Instant,
}

impl FlushSchedule {
    /// A schedule that begins now.
    pub fn new(every: FlushEvery) -> Self {
        Self { every, scans: 0, since: Instant::now() }
    }

    /// Asked after scans: whether to flush now.
    pub fn is_due(&mut self, scans: usize) -> bool {
        self.scans += scans as u64;
        match self.every {
            FlushEvery::Scans(scans) => self.scans >= scans,
            FlushEvery::Time(time) => self.since.elapsed() >= time,
            FlushEvery::End => false,
        }
    }

    /// How many scans may come before it is asked again.
    pub fn scans_until_due(&self) -> usize {
        match self.every {
            FlushEvery::Scans(scans) => {
                usize::try_from(scans.saturating_sub(self.scans)).unwrap_or(usize::MAX)
            }
            FlushEvery::Time(_) | FlushEvery::End => usize::MAX,
        }
    }

    /// Asked while no scan comes: whether to flush now what came since the last flush.
    pub fn is_due_waiting(&self) -> bool {
        match self.every {
            FlushEvery::Time(time) => self.scans > 0 && self.since.elapsed() >= time,
            FlushEvery::Scans(_) | FlushEvery::End => false,
        }
    }

    /// Whether time decides, so that a flush may go on beside scans. After so many scans is after these and no others.
    pub fn is_by_time(&self) -> bool {
        matches!(self.every, FlushEvery::Time(_))
    }

    /// The map was flushed.
    pub fn flushed(&mut self) {
        (self.scans, self.since) = (0, Instant::now());
    }
}
