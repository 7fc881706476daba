//! CPU time of other processes.

use anyhow::{Context, Result, ensure};
use std::fs;
use std::process::{Command, Stdio};

/// CPU seconds that running a command takes, the mean of so many times. Linux counts hundredths of a second.
///
/// # Errors
///
/// A program that cannot be started or fails; a system that does not tell.
pub fn cpu_seconds(times: usize, command: impl Fn() -> Command) -> Result<f64> {
    let before = cpu_of_children()?;
    for _ in 0..times {
        let mut command = command();
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let status = command.status().with_context(|| format!("{command:?}: cannot start it"))?;
        ensure!(status.success(), "{status}: {command:?}");
    }
    Ok((cpu_of_children()? - before) / times as f64)
}

/// CPU seconds of all processes that have ended and were waited for.
fn cpu_of_children() -> Result<f64> {
    const PATH: &str = "/proc/self/stat";
    /// Linux has told programs of hundredths for thirty years.
    const TICKS_PER_SECOND: f64 = 100.0;
    let text = fs::read_to_string(PATH).context("/proc/self/stat: cannot read; this needs Linux")?;
    // The name, in parentheses, may hold spaces; user and system time of children are the 14th and 15th fields after it.
    let fields: Vec<&str> =
        text.rsplit_once(')').map_or("", |(_, fields)| fields).split_whitespace().collect();
    let ticks = |field: usize| fields.get(field).and_then(|ticks| ticks.parse::<f64>().ok());
    let (user, system) = ticks(13).zip(ticks(14)).with_context(|| format!("{PATH}: unknown format"))?;
    Ok((user + system) / TICKS_PER_SECOND)
}
