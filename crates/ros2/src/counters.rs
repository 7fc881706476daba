/// Counters of received, mapped and dropped messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    pub received: u64,
    pub mapped: u64,
    /// Points of the mapped clouds, without those that were skipped.
    pub points: u64,
    /// Clouds dropped because mapping was too slow.
    pub dropped_behind: u64,
    /// Clouds skipped by `thin`.
    pub thinned: u64,
    /// Clouds whose transforms did not arrive in time, and clouds that are already in the map frame.
    pub dropped_without_pose: u64,
    /// Clouds and transforms that could not be decoded completely.
    pub malformed: u64,
    /// Clouds that exceed the queue with their points decoded.
    pub too_large: u64,
    /// Clouds refused because the map has too little memory.
    pub refused_memory: u64,
    /// Clouds refused because of a damaged tile on disk.
    pub refused_damaged: u64,
    /// Clouds refused because of a disk error.
    pub refused_disk: u64,
    /// Failed flushes, each retried.
    pub failed_flushes: u64,
    /// Transforms that are invalid or exceed the buffer.
    pub transforms_refused: u64,
    /// Number of corrected paths that the map followed.
    pub remapped: u64,
    /// Messages that the transport failed to deliver.
    pub transport_errors: u64,
}

impl std::fmt::Display for Counters {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "clouds: {} received, {} mapped, {} dropped behind, {} thinned, {} without a pose, {} malformed, \
             {} too large, {} refused for lack of memory, {} for damaged tiles, {} by the disk; {} flushes failed; \
             {} transforms refused, {} transport errors",
            self.received,
            self.mapped,
            self.dropped_behind,
            self.thinned,
            self.dropped_without_pose,
            self.malformed,
            self.too_large,
            self.refused_memory,
            self.refused_damaged,
            self.refused_disk,
            self.failed_flushes,
            self.transforms_refused,
            self.transport_errors
        )
    }
}
