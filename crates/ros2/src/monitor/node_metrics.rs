use super::monitor_server::Monitor;
use crate::health::Health;
use std::time::{Instant, UNIX_EPOCH};
use voxtile_monitoring::{Metrics, process};

/// Returns the metrics of the node.
pub fn node_metrics(monitor: &Monitor) -> String {
    let mut metrics = Metrics::default();
    process(&mut metrics, env!("CARGO_PKG_VERSION"));
    clouds(&mut metrics, monitor);
    map(&mut metrics, monitor);
    let health = monitor.map.health();
    flushes(&mut metrics, &health);
    let verdict = super::verdict(&health, None, Instant::now());
    metrics.gauge("voxtile_healthy", "1 if /health reports no problem.").value(u64::from(verdict.is_healthy));
    metrics.text().to_owned()
}

fn clouds(metrics: &mut Metrics, monitor: &Monitor) {
    let (counters, waiting) = monitor.inbox.counters();
    let mut received = metrics.counter("voxtile_clouds_received_total", "Received clouds by topic.");
    for (topic, count) in monitor.inbox.arrived() {
        received.labelled(&[("topic", &topic)], count);
    }
    metrics.counter("voxtile_clouds_mapped_total", "Clouds inserted into the map.").value(counters.mapped);
    let help = "Points of these clouds, without those that were skipped.";
    metrics.counter("voxtile_points_mapped_total", help).value(counters.points);
    let mut dropped =
        metrics.counter("voxtile_clouds_dropped_total", "Clouds that are not in the map, by cause.");
    for (cause, count) in [
        ("behind", counters.dropped_behind),
        ("thinned", counters.thinned),
        ("no_pose", counters.dropped_without_pose),
        ("malformed", counters.malformed),
        ("too_large", counters.too_large),
        ("memory", counters.refused_memory),
        ("damaged_tile", counters.refused_damaged),
        ("disk", counters.refused_disk),
    ] {
        dropped.labelled(&[("cause", cause)], count);
    }
    metrics.gauge("voxtile_clouds_waiting", "Clouds in the queue.").value(waiting as u64);
    metrics
        .counter("voxtile_transforms_refused_total", "Invalid transforms, and those beyond the buffer.")
        .value(counters.transforms_refused);
    metrics
        .counter("voxtile_transport_errors_total", "Messages that the transport lost.")
        .value(counters.transport_errors);
    metrics
        .counter("voxtile_paths_followed_total", "Corrected paths that the map followed.")
        .value(counters.remapped);
    let latencies = monitor.map.health().latencies;
    let help = "Time from the arrival of a cloud until it is in the map; quantiles of the last 1000 clouds.";
    let mut latency = metrics.summary("voxtile_cloud_latency_seconds", help);
    for (quantile, percent) in [("0.5", 50), ("0.9", 90), ("0.99", 99)] {
        if let Some(time) = latencies.percentile(percent) {
            latency.labelled(&[("quantile", quantile)], time.as_secs_f64());
        }
    }
    let (sum, count) = latencies.all();
    latency.sum_and_count(sum.as_secs_f64(), count);
}

fn map(metrics: &mut Metrics, monitor: &Monitor) {
    let health = monitor.map.health();
    let statistics = &health.statistics;
    let mut gauge = |name: &str, help: &str, value: u64| metrics.gauge(name, help).value(value);
    gauge("voxtile_map_scans", "Scans in the map.", statistics.scan_number);
    gauge("voxtile_map_unflushed_scans", "Scans that a crash would lose.", health.unflushed_scans);
    gauge("voxtile_map_tiles", "Tiles of the map.", statistics.tiles);
    gauge("voxtile_map_cached_tiles", "Tiles in memory.", statistics.cached_tiles + statistics.compact_tiles);
    gauge(
        "voxtile_map_dirty_tiles",
        "Tiles in memory that differ from the disk.",
        statistics.dirty_tiles + statistics.dirty_compact_tiles,
    );
    gauge("voxtile_map_disk_bytes", "Size of the map's tiles on disk.", statistics.disk_bytes);
    gauge("voxtile_map_spilled_bytes", "Buffered updates in temporary files.", statistics.spilled_bytes);
    gauge(
        "voxtile_memory_limit_bytes",
        "Limit for the map and the queue of clouds (--memory).",
        monitor.memory_limit_bytes,
    );
    let memory = &statistics.memory;
    let mut used = metrics.gauge("voxtile_memory_used_bytes", "Memory by purpose.");
    for (purpose, bytes) in [
        ("tiles", memory.tiles),
        ("compact_tiles", memory.compact_tiles),
        ("write_buffer", memory.write_buffer),
        ("scan", memory.scan),
        ("in_flight", memory.in_flight),
        ("index", memory.index),
        ("readers", memory.readers),
        ("cloud_queue", monitor.inbox.queue_bytes() as u64),
        ("local_map", health.local_map_bytes as u64),
    ] {
        used.labelled(&[("purpose", purpose)], bytes);
    }
    metrics
        .counter("voxtile_disk_stalls_total", "Times that mapping waited for the disk.")
        .value(statistics.stalls.count);
}

fn flushes(metrics: &mut Metrics, health: &Health) {
    metrics.counter("voxtile_flushes_total", "Successful background flushes.").value(health.flushes);
    metrics.counter("voxtile_flush_failures_total", "Failed flushes.").value(health.failed_flushes);
    let age = health.flush_age.as_secs_f64();
    metrics.gauge("voxtile_flush_age_seconds", "Time since the map on disk was last complete.").value(age);
    if let Some((at, took)) = health.last_flush {
        let at = at.duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
        metrics.gauge("voxtile_last_flush_timestamp_seconds", "End of the last flush since 1970.").value(at);
        metrics
            .gauge("voxtile_last_flush_duration_seconds", "Duration of the last flush.")
            .value(took.as_secs_f64());
    }
}
