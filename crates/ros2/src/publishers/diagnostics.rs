use crate::counters::Counters;
use crate::health::Health;
use crate::messages::{DiagnosticArray, DiagnosticStatus, Header, KeyValue, Time};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Returns the diagnostics. Rates and losses are since the previous message.
pub fn diagnostics(
    node_name: &str,
    health: &Health,
    [before, now]: [&Counters; 2],
    waiting: usize,
    since: Duration,
    problem: Option<&str>,
) -> DiagnosticArray {
    let dropped = [
        ("dropped_behind", now.dropped_behind, before.dropped_behind),
        ("thinned", now.thinned, before.thinned),
        ("dropped_without_pose", now.dropped_without_pose, before.dropped_without_pose),
        ("malformed", now.malformed, before.malformed),
        ("too_large", now.too_large, before.too_large),
        ("refused_memory", now.refused_memory, before.refused_memory),
        ("refused_damaged", now.refused_damaged, before.refused_damaged),
        ("refused_disk", now.refused_disk, before.refused_disk),
        ("transforms_refused", now.transforms_refused, before.transforms_refused),
        ("transport_errors", now.transport_errors, before.transport_errors),
    ];
    let why: Vec<&str> =
        dropped.iter().filter(|(_, now, before)| now > before).map(|(why, ..)| *why).collect();
    let per_s = |now: u64, before: u64| {
        format!("{:.2}", now.saturating_sub(before) as f64 / since.as_secs_f64().max(1e-3))
    };
    let mut values = vec![
        ("scans_per_s", per_s(now.mapped, before.mapped)),
        ("clouds_per_s", per_s(now.received, before.received)),
        ("clouds_received", now.received.to_string()),
        ("clouds_mapped", now.mapped.to_string()),
        ("clouds_waiting", waiting.to_string()),
    ];
    values.extend(dropped.map(|(why, now, _)| (why, now.to_string())));
    let Health { statistics, flush_age, latencies, .. } = health;
    let ms =
        |percent| format!("{:.1}", latencies.percentile(percent).unwrap_or_default().as_secs_f64() * 1e3);
    let memory = &statistics.memory;
    values.extend([
        ("remapped", now.remapped.to_string()),
        ("scan_number", statistics.scan_number.to_string()),
        ("tiles", statistics.tiles.to_string()),
        ("dirty_tiles", statistics.dirty_tiles.to_string()),
        ("memory_bytes", memory.bytes().to_string()),
        ("memory_tiles_bytes", memory.tiles.to_string()),
        ("memory_compact_tiles_bytes", memory.compact_tiles.to_string()),
        ("memory_write_buffer_bytes", memory.write_buffer.to_string()),
        ("memory_scan_bytes", memory.scan.to_string()),
        ("memory_in_flight_bytes", memory.in_flight.to_string()),
        ("memory_index_bytes", memory.index.to_string()),
        ("memory_readers_bytes", memory.readers.to_string()),
        ("memory_local_map_bytes", health.local_map_bytes.to_string()),
        ("disk_bytes", statistics.disk_bytes.to_string()),
        ("flush_age_s", format!("{:.1}", flush_age.as_secs_f64())),
        ("flushing", health.is_flushing.to_string()),
        ("failed_flushes", now.failed_flushes.to_string()),
        ("unflushed_scans", health.unflushed_scans.to_string()),
        ("latency_p50_ms", ms(50)),
        ("latency_p99_ms", ms(99)),
        ("stalls", statistics.stalls.count.to_string()),
        ("worst_stall_ms", (statistics.stalls.worst_us / 1000).to_string()),
    ]);
    let (level, message) = summary(&why, problem, health.has_flush_failed);
    let values = values.into_iter().map(|(key, value)| KeyValue { key: key.to_owned(), value }).collect();
    let status = DiagnosticStatus {
        level,
        name: format!("{node_name}: mapping"),
        message,
        hardware_id: String::new(),
        values,
    };
    let wall_clock = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let stamp = Time::from_ns(i64::try_from(wall_clock.as_nanos()).unwrap_or(i64::MAX));
    DiagnosticArray { header: Header { stamp, frame_id: String::new() }, status: vec![status] }
}

/// Returns the level and message of the status, with a remedy for problems that the node cannot solve.
fn summary(losses: &[&str], problem: Option<&str>, has_flush_failed: bool) -> (u8, String) {
    let remedies = losses.iter().filter_map(|loss| remedy(loss));
    let remedies: Vec<&str> = remedies.chain(has_flush_failed.then_some(FAILED_FLUSH)).collect();
    let level = match (losses, &*remedies) {
        ([], []) if problem.is_none() => return (DiagnosticStatus::OK, "mapping".to_owned()),
        // Damage affects only some tiles, so the node still maps.
        (_, [] | [DAMAGED_TILES]) => DiagnosticStatus::WARN,
        _ => DiagnosticStatus::ERROR,
    };
    let losses = if losses.is_empty() { None } else { Some(format!("losses: {}", losses.join(", "))) };
    let problem = problem.map(str::to_owned);
    let parts = losses.into_iter().chain(problem).chain(remedies.into_iter().map(str::to_owned));
    let parts: Vec<String> = parts.collect();
    (level, parts.join("; "))
}

const DAMAGED_TILES: &str =
    "tiles of the map are damaged: stop the node and run `voxtile verify` and `voxtile repair`";
const FAILED_FLUSH: &str = "the last flush failed: free disk space, or see the log";

fn remedy(loss: &str) -> Option<&'static str> {
    match loss {
        "refused_memory" => Some(
            "the map is at its memory limit: restart the node with a larger --memory, or create a map with a larger \
             --tile-size",
        ),
        "refused_damaged" => Some(DAMAGED_TILES),
        "refused_disk" => Some("writes to disk fail: free disk space, or see the log"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_losses_are_a_warning_and_old_ones_are_not() {
        let before = Counters { malformed: 3, mapped: 10, ..Counters::default() };
        let now = Counters { dropped_behind: 1, mapped: 30, ..before };
        let status_of = |counters| {
            let array = diagnostics("n", &Health::default(), counters, 0, Duration::from_secs(2), None);
            let [status] = array.status.try_into().unwrap();
            (status.level, status.message, status.values.first().unwrap().value.clone())
        };
        let warning = (DiagnosticStatus::WARN, "losses: dropped_behind".to_owned(), "10.00".to_owned());
        assert_eq!(status_of([&before, &now]), warning);
        assert_eq!(status_of([&now, &now]), (DiagnosticStatus::OK, "mapping".to_owned(), "0.00".to_owned()));
    }

    #[test]
    fn missing_poses_are_a_warning() {
        let (health, none) = (Health::default(), Counters::default());
        let array = diagnostics("n", &health, [&none; 2], 0, Duration::from_secs(1), Some("no pose: why"));
        let [status] = array.status.try_into().unwrap();
        assert_eq!((status.level, status.message.as_str()), (DiagnosticStatus::WARN, "no pose: why"));
    }

    #[test]
    fn problems_that_need_a_person_include_a_remedy() {
        let status_of = |now: Counters, has_flush_failed| {
            let health = Health { has_flush_failed, ..Health::default() };
            let array =
                diagnostics("n", &health, [&Counters::default(), &now], 0, Duration::from_secs(1), None);
            let [status] = array.status.try_into().unwrap();
            (status.level, status.message)
        };
        let none = Counters::default();
        let (level, message) = status_of(Counters { refused_damaged: 1, ..none }, false);
        assert_eq!(level, DiagnosticStatus::WARN);
        assert!(
            message.starts_with("losses: refused_damaged; ") && message.contains("voxtile repair"),
            "{message}"
        );
        let (level, message) = status_of(Counters { refused_memory: 1, malformed: 1, ..none }, false);
        assert_eq!(level, DiagnosticStatus::ERROR);
        assert!(message.starts_with("losses: malformed, refused_memory; "), "{message}");
        assert!(message.contains("larger --memory"), "{message}");
        let (level, message) = status_of(Counters { refused_disk: 1, ..none }, false);
        assert!(level == DiagnosticStatus::ERROR && message.contains("free disk space"), "{message}");
        let (level, message) = status_of(none, true);
        assert!(
            level == DiagnosticStatus::ERROR && message.starts_with("the last flush failed"),
            "{message}"
        );
    }
}
