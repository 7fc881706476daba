/// The longest time between two poses of a sensor that is filled: twice the tolerance, so that each moment in it is
/// within the tolerance of one of the two. Files of poses and transforms of recordings go by this.
pub fn most_gap_ns(tolerance_ns: i64) -> i64 {
    tolerance_ns.max(0).saturating_mul(2)
}

/// A pose so near in time is that of the scan, however far the next one is: programs round stamps, and key frames have
/// no others beside them.
pub(crate) const SAME_TIME_NS: u64 = 1_000_000;
