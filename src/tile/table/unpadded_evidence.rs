use crate::sensor::Evidence;

/// Evidence without padding: 12 bytes instead of 16.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UnpaddedEvidence {
    log_odds_bits: [u32; 2],
    observation_count: i32,
}

impl From<Evidence> for UnpaddedEvidence {
    fn from(evidence: Evidence) -> Self {
        let bits = evidence.log_odds.to_bits();
        let log_odds_bits = [bits as u32, (bits >> 32) as u32];
        Self { log_odds_bits, observation_count: evidence.observation_count }
    }
}

impl From<UnpaddedEvidence> for Evidence {
    fn from(evidence: UnpaddedEvidence) -> Self {
        let [low, high] = evidence.log_odds_bits.map(u64::from);
        Self { log_odds: f64::from_bits(low | high << 32), observation_count: evidence.observation_count }
    }
}
