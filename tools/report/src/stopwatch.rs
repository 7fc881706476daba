use anyhow::{Context, Result};
use rustix::time::{ClockId, clock_gettime};
use std::ops::Add;
use std::time::{Duration, Instant};

/// Three clocks: CPU time of this thread, CPU time of the process, and wall time.
pub struct Stopwatch {
    own: Duration,
    process: Duration,
    wall: Instant,
}

/// Elapsed time on the clocks, in seconds.
#[derive(Clone, Copy, Debug, Default)]
pub struct Elapsed {
    /// CPU time of the calling thread.
    pub own_s: f64,
    /// CPU time of the other threads.
    pub others_s: f64,
    /// Wall time.
    pub wall_s: f64,
}

impl Stopwatch {
    /// Starts all clocks.
    pub fn start() -> Result<Self> {
        Ok(Self {
            own: cpu_time(ClockId::ThreadCPUTime)?,
            process: cpu_time(ClockId::ProcessCPUTime)?,
            wall: Instant::now(),
        })
    }

    /// Reads all clocks.
    pub fn stop(&self) -> Result<Elapsed> {
        let wall_s = self.wall.elapsed().as_secs_f64();
        let process_s = cpu_time(ClockId::ProcessCPUTime)?.saturating_sub(self.process).as_secs_f64();
        let own_s = cpu_time(ClockId::ThreadCPUTime)?.saturating_sub(self.own).as_secs_f64();
        Ok(Elapsed { own_s, others_s: (process_s - own_s).max(0.0), wall_s })
    }
}

impl Elapsed {
    /// CPU time of all threads, in seconds.
    pub fn cpu_s(&self) -> f64 {
        self.own_s + self.others_s
    }
}

impl Add for Elapsed {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            own_s: self.own_s + other.own_s,
            others_s: self.others_s + other.others_s,
            wall_s: self.wall_s + other.wall_s,
        }
    }
}

fn cpu_time(clock: ClockId) -> Result<Duration> {
    Duration::try_from(clock_gettime(clock)).context("the CPU clock returned an invalid time")
}
