/// Returns the longest time between two poses that is interpolated: twice the tolerance, so that each moment between
/// them is within the tolerance of one of them. Used for pose files and for transforms of recordings.
pub fn most_gap_ns(tolerance_ns: i64) -> i64 {
    tolerance_ns.max(0).saturating_mul(2)
}

/// Maximum time between a scan and a pose that is used even if the next pose is far away in time: programs round
/// stamps, and key frames have large gaps.
pub(crate) const SAME_TIME_NS: u64 = 1_000_000;
