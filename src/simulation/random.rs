/// A number from 0 to 1 (excluded) that belongs to a seed and three other numbers: hashed, not drawn in sequence, so
/// that any part of the world can be made on its own.
pub(super) fn unit(seed: u64, a: i64, b: i64, c: i64) -> f64 {
    let mut hash = mix(seed ^ 0x6a09_e667_f3bc_c908);
    for part in [a, b, c] {
        hash = mix(hash ^ part as u64);
    }
    (hash >> 11) as f64 / (1_u64 << 53) as f64
}

/// A number from `low` to `high`, likewise.
pub(super) fn between(low: f64, high: f64, seed: u64, a: i64, b: i64, c: i64) -> f64 {
    low + (high - low) * unit(seed, a, b, c)
}

/// A number of mean 0 and standard deviation 1, likewise: the sum of twelve uniform ones, which needs no logarithm.
pub(super) fn normal(seed: u64, a: i64, b: i64) -> f64 {
    (0..12).map(|c| unit(seed, a, b, c)).sum::<f64>() - 6.0
}

/// The finalizer of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014).
fn mix(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
