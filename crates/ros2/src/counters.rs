/// What became of all that came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    pub received: u64,
    pub mapped: u64,
    /// Dropped because mapping was behind.
    pub dropped_behind: u64,
    /// Left out by `thin`.
    pub thinned: u64,
    /// No transforms on both sides of their stamp in time, or in the frame of the map already.
    pub dropped_without_pose: u64,
    /// Clouds and transforms that could not be decoded, or not whole.
    pub malformed: u64,
    /// Clouds that are larger than the whole queue, with their points decoded.
    pub too_large: u64,
    /// Clouds for which the map has too little memory.
    pub refused_memory: u64,
    /// Clouds that touch a tile that is damaged on disk.
    pub refused_damaged: u64,
    /// Clouds for which the disk did not do what it was to do.
    pub refused_disk: u64,
    /// Flushes that were to be tried again.
    pub failed_flushes: u64,
    /// Transforms that are not valid, or more than the buffer takes.
    pub transforms_refused: u64,
    /// How often the map followed a corrected path.
    pub remapped: u64,
    /// Samples that the transport could not deliver.
    pub transport_errors: u64,
}

impl std::fmt::Display for Counters {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "clouds: {} received, {} mapped, {} dropped behind, {} thinned, {} without a pose, {} malformed, \
             {} too large, {} refused for want of memory, {} for damaged tiles, {} by the disk; {} flushes failed; \
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
