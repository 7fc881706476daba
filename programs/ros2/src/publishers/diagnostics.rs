use crate::counters::Counters;
use crate::health::Health;
use crate::messages::{DiagnosticArray, DiagnosticStatus, Header, KeyValue, Time};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// How the node does, since the last such message.
pub fn diagnostics(
    node_name: &str,
    health: &Health,
    [before, now]: [&Counters; 2],
    waiting: usize,
    since: Duration,
) -> DiagnosticArray {
    let dropped = [
        ("dropped_behind", now.dropped_behind, before.dropped_behind),
        ("thinned", now.thinned, before.thinned),
        ("dropped_without_pose", now.dropped_without_pose, before.dropped_without_pose),
        ("malformed", now.malformed, before.malformed),
        ("too_large", now.too_large, before.too_large),
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
    let Health { statistics, unflushed_scans, flush_age, is_flushing, local_map_bytes, latencies } = health;
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
        ("memory_local_map_bytes", local_map_bytes.to_string()),
        ("disk_bytes", statistics.disk_bytes.to_string()),
        ("flush_age_s", format!("{:.1}", flush_age.as_secs_f64())),
        ("flushing", is_flushing.to_string()),
        ("unflushed_scans", unflushed_scans.to_string()),
        ("latency_p50_ms", ms(50)),
        ("latency_p99_ms", ms(99)),
        ("stalls", statistics.stalls.count.to_string()),
        ("worst_stall_ms", (statistics.stalls.worst_us / 1000).to_string()),
    ]);
    let (level, message) = match why.is_empty() {
        true => (DiagnosticStatus::OK, "mapping".to_owned()),
        false => (DiagnosticStatus::WARN, format!("losses: {}", why.join(", "))),
    };
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_losses_are_a_warning_and_old_ones_are_not() {
        let before = Counters { malformed: 3, mapped: 10, ..Counters::default() };
        let now = Counters { dropped_behind: 1, mapped: 30, ..before };
        let told = |counters| {
            let array = diagnostics("n", &Health::default(), counters, 0, Duration::from_secs(2));
            let [status] = array.status.try_into().unwrap();
            (status.level, status.message, status.values.first().unwrap().value.clone())
        };
        let warning = (DiagnosticStatus::WARN, "losses: dropped_behind".to_owned(), "10.00".to_owned());
        assert_eq!(told([&before, &now]), warning);
        assert_eq!(told([&now, &now]), (DiagnosticStatus::OK, "mapping".to_owned(), "0.00".to_owned()));
    }
}
