use crate::latencies::Latencies;
use std::time::Duration;
use voxtile::mapper::MapStatistics;

/// State of the map, sampled by its mapper about once a second.
#[derive(Clone, Debug, Default)]
pub struct Health {
    pub statistics: MapStatistics,
    /// Number of scans that a crash would lose.
    pub unflushed_scans: u64,
    /// Time since the map on disk was last complete or last updated by a flush.
    pub flush_age: Duration,
    pub is_flushing: bool,
    /// Whether the last flush failed.
    pub has_flush_failed: bool,
    /// Memory of the local map, not included in the statistics.
    pub local_map_bytes: usize,
    pub latencies: Latencies,
}
