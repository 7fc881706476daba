use super::answer_memory::AnswerMemory;
use super::connections::Connections;
use super::served_map::ServedMap;
use hyper::StatusCode;
use parking_lot::Mutex;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::UNIX_EPOCH;
use voxtile::mapper::MapView;
use voxtile_monitoring::{Metrics, process};
use voxtile_pipeline::AnyMap;

/// Number of responses by status.
#[derive(Default)]
pub struct Responses(Mutex<BTreeMap<u16, u64>>);

impl Responses {
    pub fn count(&self, status: StatusCode) {
        *self.0.lock().entry(status.as_u16()).or_default() += 1;
    }
}

/// Returns a value of a map, if there is one.
type ValueOf = fn(&ServedMap) -> Option<u64>;

/// Returns the metrics of the server and its maps.
pub fn metrics(
    maps: &[Arc<ServedMap>],
    responses: &Responses,
    connections: &Connections,
    memory: &AnswerMemory,
) -> String {
    let mut metrics = Metrics::default();
    process(&mut metrics, env!("CARGO_PKG_VERSION"));
    let mut all = metrics.counter("voxtile_http_responses_total", "HTTP responses by status.");
    for (status, count) in &*responses.0.lock() {
        all.labelled(&[("code", &status.to_string())], *count);
    }
    metrics.gauge("voxtile_http_connections", "Open connections.").value(connections.count() as u64);
    let help = "Memory of large responses that clients have not read yet.";
    metrics.gauge("voxtile_http_response_memory_bytes", help).value(memory.bytes() as u64);
    metrics
        .gauge("voxtile_http_response_memory_limit_bytes", "Limit for this memory.")
        .value(AnswerMemory::limit_bytes() as u64);
    let gauges: [(&str, &str, ValueOf); 6] = [
        ("voxtile_map_scans", "Scans in the map.", |map| Some(map.now().map.scan_number())),
        ("voxtile_map_tiles", "Tiles of the map.", |map| Some(map.now().map.tile_indices().len() as u64)),
        ("voxtile_map_disk_bytes", "Size of the map's tiles on disk.", |map| match &map.now().map {
            AnyMap::Map(map) => map.disk_bytes().map(|(table, octree)| table + octree),
            AnyMap::Octree(_) => None,
        }),
        ("voxtile_map_pending_tiles", "Tiles that are not in the coarse levels yet.", |map| {
            Some(map.now().pending_tiles)
        }),
        ("voxtile_map_unreadable_tiles", "Tiles that cannot be read.", |map| {
            Some(map.now().levels.unreadable().len() as u64)
        }),
        (
            "voxtile_map_last_flush_timestamp_seconds",
            "Time of the last flush by any process since 1970.",
            |map| {
                let time = map.flushed_at()?.duration_since(UNIX_EPOCH).ok()?;
                Some(time.as_secs())
            },
        ),
    ];
    for (name, help, value) in gauges {
        let mut gauge = metrics.gauge(name, help);
        for (number, map) in maps.iter().enumerate() {
            if let Some(value) = value(map) {
                gauge.labelled(&[("map", &number.to_string()), ("name", map.name())], value);
            }
        }
    }
    metrics.text().to_owned()
}
