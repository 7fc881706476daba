use crate::latencies::Latencies;
use crate::refusal::Refusal;
use std::time::{Duration, Instant, SystemTime};
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
    /// Number of successful background flushes.
    pub flushes: u64,
    pub failed_flushes: u64,
    /// End and duration of the last successful background flush.
    pub last_flush: Option<(SystemTime, Duration)>,
    /// Last cloud that the map refused.
    pub refused_at: Option<(Instant, Refusal)>,
    /// Time of the sample.
    pub sampled_at: Option<Instant>,
}
