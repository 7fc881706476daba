/// What became of all that came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    pub received: u64,
    pub mapped: u64,
    /// Dropped because mapping was behind.
    pub dropped_behind: u64,
    /// Left out by `thin`.
    pub thinned: u64,
    /// No transforms on both sides of their stamp in time.
    pub dropped_without_pose: u64,
    /// Clouds and transforms that could not be decoded, or not whole.
    pub malformed: u64,
    /// Clouds that are larger than the whole queue, with their points decoded.
    pub too_large: u64,
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
             {} too large; {} transforms refused, {} transport errors",
            self.received,
            self.mapped,
            self.dropped_behind,
            self.thinned,
            self.dropped_without_pose,
            self.malformed,
            self.too_large,
            self.transforms_refused,
            self.transport_errors
        )
    }
}
