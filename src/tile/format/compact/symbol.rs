/// Symbols of a codebook's states: one byte per voxel and, for some, a second one.
///
/// Symbols below [`first_prefix`](Self::first_prefix) are the codebook's first states. A prefix represents 256 states,
/// of which the second byte selects one. [`RARE`] marks a state that is not in the codebook.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Symbols {
    states: usize,
    first_prefix: usize,
}

/// Symbol of a voxel whose state is stored explicitly.
pub(super) const RARE: u8 = u8::MAX;

/// Maximum number of states in a codebook; half of the symbols are then prefixes.
pub(super) const MAX_STATES: usize = 255 + 127 * 255;

impl Symbols {
    /// Creates symbols for `states` states, at most [`MAX_STATES`].
    pub(super) fn of(states: usize) -> Self {
        let prefixes = states.saturating_sub(255).div_ceil(255);
        Self { states, first_prefix: 255 - prefixes }
    }

    pub(super) fn first_prefix(self) -> u8 {
        self.first_prefix as u8
    }

    /// The first symbol that does not identify a state by itself.
    pub(super) fn direct(self) -> u8 {
        self.states.min(self.first_prefix) as u8
    }

    /// Code of a state: its symbol, with the second byte in the upper byte.
    pub(super) fn code(self, number: usize) -> u16 {
        match number.checked_sub(self.first_prefix) {
            None => number as u16,
            Some(index) => (self.first_prefix + index / 256) as u16 | ((index % 256) as u16) << 8,
        }
    }

    /// State number of a prefix and a second byte; `None` if the codebook has no such state.
    pub(super) fn number(self, prefix: u8, second: u8) -> Option<usize> {
        let index = (usize::from(prefix) - self.first_prefix) * 256 + usize::from(second);
        Some(self.first_prefix + index).filter(|&number| number < self.states)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_and_symbols_correspond_one_to_one() {
        for states in [0, 1, 254, 255, 256, 509, 510, 511, 5000, MAX_STATES] {
            let symbols = Symbols::of(states);
            assert!(symbols.first_prefix >= 128);
            for number in 0..states {
                let [symbol, second] = symbols.code(number).to_le_bytes();
                assert_ne!(symbol, RARE);
                match symbol < symbols.first_prefix() {
                    true => assert_eq!(usize::from(symbol), number),
                    false => assert_eq!(symbols.number(symbol, second), Some(number)),
                }
            }
            for prefix in symbols.first_prefix()..RARE {
                let known = (0..=255).filter(|&second| symbols.number(prefix, second).is_some());
                assert!(known.count() > 0, "{states} {prefix}");
            }
        }
    }
}
