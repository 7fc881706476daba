//! CPU time of other processes.

use anyhow::{Context, Result, ensure};
use std::fs;
use std::process::{Command, Stdio};

/// Mean CPU time of a command over several runs, in seconds. Linux counts hundredths of a second.
///
/// # Errors
///
/// Fails if the program cannot be started or fails, or if the system does not report CPU times.
pub fn cpu_seconds(times: usize, command: impl Fn() -> Command) -> Result<f64> {
    let before = cpu_of_children()?;
    for _ in 0..times {
        let mut command = command();
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let status = command.status().with_context(|| format!("{command:?}: cannot start"))?;
        ensure!(status.success(), "{status}: {command:?}");
    }
    Ok((cpu_of_children()? - before) / times as f64)
}

/// CPU time of all child processes that were waited for, in seconds.
fn cpu_of_children() -> Result<f64> {
    const PATH: &str = "/proc/self/stat";
    /// USER_HZ, which is 100 on x86-64 and AArch64 Linux.
    const TICKS_PER_SECOND: f64 = 100.0;
    let text = fs::read_to_string(PATH).context("/proc/self/stat: cannot read; this needs Linux")?;
    // The name in parentheses may contain spaces. User and system time of children are the 14th and 15th fields after
    // it.
    let fields: Vec<&str> =
        text.rsplit_once(')').map_or("", |(_, fields)| fields).split_whitespace().collect();
    let ticks = |field: usize| fields.get(field).and_then(|ticks| ticks.parse::<f64>().ok());
    let (user, system) = ticks(13).zip(ticks(14)).with_context(|| format!("{PATH}: unknown format"))?;
    Ok((user + system) / TICKS_PER_SECOND)
}
