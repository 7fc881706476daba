use crate::sensor::Evidence;

/// Evidence without padding: 12 bytes instead of 16.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Packed {
    log_odds_bits: [u32; 2],
    observation_count: i32,
}

impl From<Evidence> for Packed {
    fn from(evidence: Evidence) -> Self {
        let bits = evidence.log_odds.to_bits();
        let log_odds_bits = [bits as u32, (bits >> 32) as u32];
        Self { log_odds_bits, observation_count: evidence.observation_count }
    }
}

impl From<Packed> for Evidence {
    fn from(packed: Packed) -> Self {
        let [low, high] = packed.log_odds_bits.map(u64::from);
        Self { log_odds: f64::from_bits(low | high << 32), observation_count: packed.observation_count }
    }
}
