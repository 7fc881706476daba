use std::hash::{BuildHasher, Hasher, RandomState};

/// Returns a unique id for a new map, 16 bytes. It only identifies the map and does not affect results.
pub(crate) fn new_map_id() -> [u8; 16] {
    let mut hasher = blake3::Hasher::new();
    for _ in 0..2 {
        // The standard library seeds its hash maps from the system's random number generator.
        hasher.update(&RandomState::new().build_hasher().finish().to_le_bytes());
    }
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    hasher.update(&now.as_nanos().to_le_bytes());
    hasher.update(&std::process::id().to_le_bytes());
    let digest = hasher.finalize();
    std::array::from_fn(|k| digest.as_bytes()[k])
}
