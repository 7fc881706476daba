use super::EntryBytes;
use crate::error::FormatError;
use crate::sensor::Evidence;
use crate::space::VoxelKey;

#[derive(Clone, Copy)]
pub(super) struct Entry {
    pub(super) key: VoxelKey,
    pub(super) evidence: Evidence,
}

impl Entry {
    #[inline]
    pub(super) fn of(bytes: &EntryBytes) -> Self {
        let u16_at = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        Self {
            key: VoxelKey([u16_at(0), u16_at(2), u16_at(4)]),
            evidence: Evidence {
                log_odds: f64::from_le_bytes(std::array::from_fn(|k| bytes[6 + k])),
                observation_count: i32::from_le_bytes(std::array::from_fn(|k| bytes[14 + k])),
            },
        }
    }
}

/// Error for an entry at `offset` whose key belongs to another tile.
pub(super) fn of_another_tile(key: VoxelKey, offset: u64) -> FormatError {
    FormatError::at_offset(offset, format!("key {:?} belongs to another tile", key.0))
}

/// Checks that the values of an entry at `offset` are valid evidence.
#[inline]
pub(super) fn check_evidence(evidence: Evidence, offset: u64) -> Result<(), FormatError> {
    match fault_of(evidence) {
        None => Ok(()),
        Some((within, reason)) => Err(FormatError::at_offset(offset + within, reason)),
    }
}

/// Returns the offset in the entry of an invalid value, and the reason; `None` if the values are valid evidence.
#[inline]
pub(super) fn fault_of(Evidence { log_odds, observation_count }: Evidence) -> Option<(u64, String)> {
    if !log_odds.is_finite() {
        return Some((6, format!("log-odds {log_odds} are not finite")));
    }
    (observation_count < 0).then(|| (14, format!("observation count {observation_count} is negative")))
}
