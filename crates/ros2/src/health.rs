use crate::latencies::Latencies;
use std::time::Duration;
use voxtile::mapper::MapStatistics;

/// How the map is, as its mapper sees it about once a second.
#[derive(Clone, Debug, Default)]
pub struct Health {
    pub statistics: MapStatistics,
    /// Scans that a crash would take away.
    pub unflushed_scans: u64,
    /// Since the map on disk was last what is in memory, or made newer.
    pub flush_age: Duration,
    pub is_flushing: bool,
    /// Whether the last flush has failed.
    pub has_flush_failed: bool,
    /// Of the local map, beside the statistics.
    pub local_map_bytes: usize,
    pub latencies: Latencies,
}
