use super::state_counts::{StateCounts, StateKey};
use super::symbol::{MAX_STATES, RARE, Symbols};
use crate::sensor::Evidence;
use crate::tile::Table;
use crate::tile::table::{Palette, StateId};
use rustc_hash::FxHashMap;
use std::cmp::Reverse;

/// Codebook of a table: the states (log-odds and observation count) that occur in more than one voxel, with numbers and
/// symbols.
pub(super) struct Codebook {
    pub(super) states: Vec<Evidence>,
    pub(super) symbols: Symbols,
    /// Code of each state by its number in the table's palette, see [`Symbols::code`]; [`RARE`] for all other states.
    pub(super) interned: Vec<u16>,
    /// Codes of states that are not in the palette.
    others: FxHashMap<StateKey, u16>,
}

/// State that occurs in more than one voxel.
struct Common {
    voxels: u32,
    state: StateKey,
    /// Number of the state in the table's palette.
    interned: Option<StateId>,
}

impl Common {
    /// Sort key of a total order in which adjacent states are similar.
    fn rank(&self) -> (i32, u64) {
        let bits = self.state.log_odds_bits;
        (self.state.observation_count, if bits >> 63 == 1 { !bits } else { bits | 1 << 63 })
    }
}

impl Codebook {
    pub(super) fn of(table: &Table) -> Self {
        let counts = StateCounts::of(table);
        let mut commons = commons(&counts, &table.palette);
        commons.sort_unstable_by_key(|common| (Reverse(common.voxels), common.rank()));
        commons.truncate(MAX_STATES);
        let symbols = Symbols::of(commons.len());
        // Sort similar states together, which compresses better. A new order within the one-byte symbols, and within
        // the two-byte symbols, does not change the length of the symbols.
        let (one_byte, two_bytes) = commons.split_at_mut(symbols.direct().into());
        one_byte.sort_unstable_by_key(|common| common.rank());
        two_bytes.sort_unstable_by_key(|common| common.rank());

        let mut interned = vec![u16::from(RARE); counts.interned.len()];
        let mut others = FxHashMap::default();
        for (number, common) in commons.iter().enumerate() {
            match common.interned {
                Some(state) => interned[usize::from(state)] = symbols.code(number),
                None => _ = others.insert(common.state, symbols.code(number)),
            }
        }
        Self { states: commons.iter().map(|common| common.state.into()).collect(), symbols, interned, others }
    }

    /// Returns the code of a state that may not be in the palette.
    pub(super) fn code(&self, evidence: Evidence, palette: &Palette) -> u16 {
        match palette.find(evidence) {
            Some(state) => self.interned[usize::from(state)],
            None => self.others.get(&evidence.into()).copied().unwrap_or(RARE.into()),
        }
    }
}

fn commons(counts: &StateCounts, palette: &Palette) -> Vec<Common> {
    let interned = counts.interned.iter().enumerate().map(|(state, &voxels)| {
        let state = state as StateId;
        Common { voxels, state: palette.evidence(state).into(), interned: Some(state) }
    });
    let others = counts.others.iter().map(|(&state, &voxels)| Common { voxels, state, interned: None });
    interned.chain(others).filter(|common| common.voxels > 1).collect()
}
