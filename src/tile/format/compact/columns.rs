use crate::sensor::Evidence;

/// Size of a state in bytes.
pub(super) const STATE_BYTES: usize = 12;

/// Appends states as byte planes: the lowest bytes of all counts, their next bytes, ..., the highest bytes of all
/// log-odds. Equal bytes of similar states are adjacent.
pub(super) fn put_states(states: impl Iterator<Item = Evidence> + Clone, out: &mut Vec<u8>) {
    for byte in 0..4 {
        out.extend(states.clone().map(|state| state.observation_count.to_le_bytes()[byte]));
    }
    for byte in 0..8 {
        out.extend(states.clone().map(|state| state.log_odds.to_le_bytes()[byte]));
    }
}

/// Returns the state with a number from the output of [`put_states`], whose length is a multiple of a state's.
pub(super) fn state_at(states: &[u8], place: usize) -> Evidence {
    let count = states.len() / STATE_BYTES;
    let byte = |column: usize| states[column * count + place];
    Evidence {
        log_odds: f64::from_le_bytes(std::array::from_fn(|k| byte(4 + k))),
        observation_count: i32::from_le_bytes(std::array::from_fn(byte)),
    }
}
