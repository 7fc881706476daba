use crate::{Metrics, log_counts};
use std::sync::LazyLock;
use std::time::{SystemTime, UNIX_EPOCH};

/// Time of the first call of [`note_start`] or [`process`].
static STARTED: LazyLock<f64> =
    LazyLock::new(|| SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64());

/// Records the time of the start of the program.
pub fn note_start() {
    LazyLock::force(&STARTED);
}

/// Adds the metrics of this process by the usual names (memory and files on Linux alone), of its log, and its version.
pub fn process(metrics: &mut Metrics, version: &str) {
    metrics.gauge("voxtile_build_info", "Version of the program.").labelled(&[("version", version)], 1);
    metrics
        .gauge("process_start_time_seconds", "Start of the process since 1970, in seconds.")
        .value(*STARTED);
    if let Some(bytes) = resident_bytes() {
        metrics.gauge("process_resident_memory_bytes", "Resident memory in bytes.").value(bytes);
    }
    if let Ok(files) = std::fs::read_dir("/proc/self/fd") {
        // Without the descriptor of the listing itself.
        let open = (files.count() as u64).saturating_sub(1);
        metrics.gauge("process_open_fds", "Open file descriptors.").value(open);
    }
    let mut messages = metrics.counter("voxtile_log_messages_total", "Log messages by level.");
    for (level, count) in log_counts() {
        messages.labelled(&[("level", &level.as_str().to_ascii_lowercase())], count);
    }
}

fn resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kib: u64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(kib << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn memory_and_files_are_plausible() {
        let mut metrics = Metrics::default();
        process(&mut metrics, "1.2.3");
        let value = |name: &str| -> f64 {
            let line = metrics.text().lines().find(|line| line.starts_with(name)).unwrap();
            line.rsplit(' ').next().unwrap().parse().unwrap()
        };
        assert!(value("process_resident_memory_bytes") > 1e5);
        assert!(value("process_open_fds") >= 3.0);
        assert!(value("process_start_time_seconds") > 1.7e9);
        assert!(metrics.text().contains("voxtile_build_info{version=\"1.2.3\"} 1\n"));
    }
}
