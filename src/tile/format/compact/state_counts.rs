use crate::sensor::Evidence;
use crate::tile::Table;
use crate::tile::table::{Brick, Palette, StateId, Storage};
use rustc_hash::FxHashMap;

/// Number of voxels per state of a table.
pub(super) struct StateCounts {
    /// By number in the table's palette.
    pub(super) interned: Vec<u32>,
    /// For states that are not in the palette.
    pub(super) others: FxHashMap<StateKey, u32>,
    /// Number of further states that can be counted.
    remaining: usize,
}

/// Bits of a state.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct StateKey {
    pub(super) log_odds_bits: u64,
    pub(super) observation_count: i32,
}

/// Maximum number of states that are counted: as many as a palette can contain. A table has more only if some of its
/// bricks do not use the palette; then the first states in Morton order are counted.
const MAX_COUNTED: usize = (1 << 16) - 1;

impl From<Evidence> for StateKey {
    fn from(evidence: Evidence) -> Self {
        Self { log_odds_bits: evidence.log_odds.to_bits(), observation_count: evidence.observation_count }
    }
}

impl From<StateKey> for Evidence {
    fn from(key: StateKey) -> Self {
        Self { log_odds: f64::from_bits(key.log_odds_bits), observation_count: key.observation_count }
    }
}

impl StateCounts {
    pub(super) fn of(table: &Table) -> Self {
        let interned = vec![0; table.palette.len()];
        let mut all = Self { interned, others: FxHashMap::default(), remaining: MAX_COUNTED };
        if table.bricks.iter().all(|brick| matches!(brick.evidence, Storage::Interned(_))) {
            // All are counted, so the order is irrelevant.
            let mut counts = vec![[0; LANES]; table.palette.len()];
            table.bricks.iter().for_each(|brick| count_all(brick, &mut counts));
            all.interned = counts.iter().map(|lanes| lanes.iter().sum()).collect();
        } else {
            table.bricks_in_order().for_each(|brick| all.count_first(brick, &table.palette));
        }
        all
    }

    fn count_first(&mut self, brick: &Brick, palette: &Palette) {
        match &brick.evidence {
            Storage::Interned(cells) => cells.for_each(brick.observed, |_, state| self.count_interned(state)),
            Storage::Plain(cells) => cells.for_each(brick.observed, |_, stored| {
                let evidence = stored.into();
                match palette.find(evidence) {
                    Some(state) => self.count_interned(state),
                    None => self.count_other(evidence),
                }
            }),
        }
    }

    fn count_interned(&mut self, state: StateId) {
        let count = &mut self.interned[usize::from(state)];
        if *count > 0 || self.remaining > 0 {
            self.remaining -= usize::from(*count == 0);
            *count += 1;
        }
    }

    fn count_other(&mut self, evidence: Evidence) {
        if let Some(count) = self.others.get_mut(&evidence.into()) {
            *count += 1;
        } else if self.remaining > 0 {
            self.remaining -= 1;
            self.others.insert(evidence.into(), 1);
        }
    }
}

/// Number of counters per state. Adjacent voxels often have the same state, and with alternating counters no increment
/// waits for the one before.
const LANES: usize = 4;

fn count_all(brick: &Brick, counts: &mut [[u32; LANES]]) {
    if let Storage::Interned(cells) = &brick.evidence {
        let mut lane = 0;
        cells.for_each(brick.observed, |_, state| {
            counts[usize::from(state)][lane % LANES] += 1;
            lane += 1;
        });
    }
}
