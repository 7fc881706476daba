use super::cells::{CELL_VOXELS, Cells};
use super::palette::{Palette, StateId};
use super::summary::{Summary, larger};
use super::unpadded_evidence::UnpaddedEvidence;
use crate::octree::BrickNodes;
use crate::sensor::Evidence;
use crate::space::{BrickCode, BrickMask, places};

/// Evidence of the observed voxels of one brick.
#[derive(Clone, Debug)]
pub(crate) struct Brick {
    code: BrickCode,
    pub(crate) observed: BrickMask,
    pub(crate) evidence: Storage,
    pub(crate) summary: Summary,
}

#[derive(Clone, Debug)]
pub(crate) enum Storage {
    /// Number of each voxel's state in the tile's palette; [`UNKNOWN`](super::palette::UNKNOWN) for unobserved voxels.
    Interned(Cells<StateId>),
    /// The evidence of each voxel, if there are too many states for a palette; arbitrary for unobserved voxels.
    Plain(Cells<UnpaddedEvidence>),
}

impl Brick {
    /// Represents absent bricks.
    pub(crate) const ABSENT_BRICK: &Self = &Self::new(BrickCode(0));

    pub(crate) const fn new(code: BrickCode) -> Self {
        let evidence = Storage::Interned(Cells::empty());
        Self { code, observed: [0; 8], evidence, summary: Summary::EMPTY }
    }

    pub(crate) const fn with(code: BrickCode, observed: BrickMask, evidence: Storage) -> Self {
        Self { code, observed, evidence, summary: Summary::STALE }
    }

    pub(crate) fn code(&self) -> BrickCode {
        self.code
    }

    #[inline]
    pub(crate) fn heap_bytes(&self) -> usize {
        match &self.evidence {
            Storage::Interned(cells) => cells.bytes(),
            Storage::Plain(cells) => cells.bytes(),
        }
    }

    /// Reads the brick to load it into the CPU cache.
    #[inline]
    pub(crate) fn prefetch_storage(&self) {
        std::hint::black_box((self.observed[0], self.heap_bytes()));
    }

    /// Reads each line of the cells to load them into the CPU cache.
    #[inline]
    pub(crate) fn prefetch_cells(&self) {
        if let Storage::Interned(cells) = &self.evidence {
            let look = |cell: &[StateId; CELL_VOXELS]| cell[0] ^ cell[CELL_VOXELS / 2];
            std::hint::black_box(cells.all().iter().fold(0, |all, cell| all ^ look(cell)));
        }
    }

    #[inline]
    pub(crate) fn get(&self, place: usize, palette: &Palette) -> Option<Evidence> {
        let (word, bit) = (place / 64, place % 64);
        if self.observed[word] >> bit & 1 == 0 {
            return None;
        }
        match &self.evidence {
            Storage::Interned(cells) => cells.cell(word).map(|cell| palette.evidence(cell[bit])),
            Storage::Plain(cells) => cells.cell(word).map(|cell| cell[bit].into()),
        }
    }

    /// The observed voxels in Morton order, as position and evidence.
    pub(crate) fn iter(&self, palette: &Palette) -> impl Iterator<Item = (usize, Evidence)> {
        places(self.observed).filter_map(|place| Some((place, self.get(place, palette)?)))
    }

    /// Visits the items of [`Brick::iter`], one cell at a time.
    pub(crate) fn for_each(&self, palette: &Palette, mut visit: impl FnMut(usize, Evidence)) {
        match &self.evidence {
            Storage::Interned(cells) => {
                cells.for_each(self.observed, |place, state| visit(place, palette.evidence(state)));
            }
            Storage::Plain(cells) => {
                cells.for_each(self.observed, |place, evidence| visit(place, evidence.into()))
            }
        }
    }

    /// Mask of the observed voxels whose log-odds are at least a threshold.
    pub(crate) fn mask_from(&self, threshold: f64, palette: &Palette) -> BrickMask {
        std::array::from_fn(|word| self.word_from(word, threshold, palette))
    }

    /// One word of [`Brick::mask_from`].
    pub(crate) fn word_from(&self, word: usize, threshold: f64, palette: &Palette) -> u64 {
        let from_threshold = match &self.evidence {
            Storage::Interned(cells) => cells.cell(word).map(|cell| bits_of_states(cell, threshold, palette)),
            Storage::Plain(cells) => cells
                .cell(word)
                .map(|cell| bits_of(cell.map(|evidence| Evidence::from(evidence).log_odds >= threshold))),
        };
        from_threshold.unwrap_or(0) & self.observed[word]
    }

    /// Stores the evidence in the brick itself, without the palette.
    pub(crate) fn make_plain(&mut self, palette: &Palette) {
        if let Storage::Interned(cells) = &self.evidence {
            self.evidence = Storage::Plain(cells.map(|state| palette.evidence(state).into()));
        }
    }

    /// Largest log-odds of the observed voxels among `span` (a power of eight) positions from `first` on.
    pub(crate) fn max_of(&self, first: usize, span: usize, palette: &Palette) -> Option<f32> {
        let run = if span < 64 { ((1 << span) - 1) << (first % 64) } else { u64::MAX };
        let words = first / 64..(first + span).div_ceil(64);
        let mask =
            std::array::from_fn(|word| if words.contains(&word) { self.observed[word] & run } else { 0 });
        let mut max: Option<f32> = None;
        let mut take = |evidence: Evidence| {
            let value = evidence.log_odds as f32;
            max = Some(max.map_or(value, |max| larger(max, value)));
        };
        match &self.evidence {
            Storage::Interned(cells) => cells.for_each(mask, |_, state| take(palette.evidence(state))),
            Storage::Plain(cells) => cells.for_each(mask, |_, evidence| take(evidence.into())),
        }
        max
    }

    /// Largest log-odds of all observed voxels. There must be at least one.
    pub(crate) fn max(&self, palette: &Palette) -> Option<f32> {
        if self.summary.is_stale { self.max_of(0, 512, palette) } else { Some(self.summary.max) }
    }

    /// Returns the nodes of an octree under the brick, and the largest value. Voxels of at least the threshold are
    /// occupied.
    pub(crate) fn nodes(&self, threshold: Option<f32>, palette: &Palette) -> (BrickNodes, f32) {
        const NONE: f32 = f32::NEG_INFINITY;
        match &self.evidence {
            Storage::Interned(cells) => BrickNodes::of_values(self.code, self.observed, threshold, |word| {
                cells.cell(word).map_or([NONE; CELL_VOXELS], |cell| palette.values(cell))
            }),
            Storage::Plain(cells) => BrickNodes::of_values(self.code, self.observed, threshold, |word| {
                let mut values = [NONE; CELL_VOXELS];
                let mut mask = [0; 8];
                mask[word] = self.observed[word];
                cells.for_each(mask, |place, evidence| {
                    values[place % 64] = Evidence::from(evidence).log_odds as f32
                });
                values
            }),
        }
    }

    /// Upper bound of the voxels' log-odds, rounded to `f32`.
    #[inline]
    pub(crate) fn bound(&self) -> f32 {
        self.summary.max
    }

    /// Returns whether all log-odds are known to be below a threshold.
    #[inline]
    pub(crate) fn is_below(&self, threshold: f64) -> bool {
        self.summary.is_below(threshold)
    }

    /// Summary of the brick, as of the last [`Brick::sum_up`].
    pub(crate) fn summary(&self) -> Summary {
        self.summary
    }

    /// Updates the summary.
    pub(crate) fn sum_up(&mut self, palette: &Palette) {
        if self.summary.is_stale {
            self.summary = self.nodes(None, palette).into();
        }
    }

    /// Number of observed voxels whose state is selected in `states`, or whose own evidence satisfies `holds`.
    pub(crate) fn count(&self, states: &[bool], holds: impl Fn(Evidence) -> bool) -> usize {
        match &self.evidence {
            Storage::Interned(cells) => {
                cells.all().iter().flatten().filter(|&&state| states[usize::from(state)]).count()
            }
            Storage::Plain(cells) => {
                let mut count = 0;
                cells.for_each(self.observed, |_, evidence| count += usize::from(holds(evidence.into())));
                count
            }
        }
    }

    /// Records the largest log-odds of a brick that was created as a whole.
    pub(crate) fn note_max(&mut self, palette: &Palette) {
        if let Storage::Interned(cells) = &self.evidence {
            // Several independent comparisons, because each would otherwise wait for the one before.
            const LANES: usize = 16;
            let mut largest = [f32::NEG_INFINITY; LANES];
            for cell in cells.all() {
                for values in palette.values(cell).as_chunks::<LANES>().0 {
                    largest = std::array::from_fn(|k| larger(largest[k], values[k]));
                }
            }
            self.summary.max = largest.into_iter().fold(f32::NEG_INFINITY, larger);
        }
    }

    pub(crate) fn mark_states(&self, in_use: &mut [bool]) {
        if let Storage::Interned(cells) = &self.evidence {
            cells.all().iter().flatten().for_each(|&state| in_use[usize::from(state)] = true);
        }
    }

    /// Renumbers the states after a change of the palette.
    pub(crate) fn renumber_states(&mut self, numbers: &[StateId]) {
        if let Storage::Interned(cells) = &mut self.evidence {
            cells.all_mut().iter_mut().flatten().for_each(|state| *state = numbers[usize::from(*state)]);
        }
    }
}

/// Bits of the states of a cell whose log-odds are at least a threshold.
fn bits_of_states(cell: &[StateId; CELL_VOXELS], threshold: f64, palette: &Palette) -> u64 {
    // Rounded numbers keep their order. Only those that equal the rounded threshold are compared exactly.
    let (values, rounded) = (palette.values(cell), threshold as f32);
    let mut bits = bits_of(values.map(|value| value > rounded));
    let mut equal = bits_of(values.map(|value| value == rounded));
    while equal != 0 {
        let bit = equal.trailing_zeros();
        equal &= equal - 1;
        let is_from = palette.evidence(cell[bit as usize]).log_odds >= threshold;
        bits |= u64::from(is_from) << bit;
    }
    bits
}

/// Packs flags into bits. Branchless, because they are hard to predict.
#[inline]
fn bits_of(flags: [bool; CELL_VOXELS]) -> u64 {
    let mut bits = 0;
    for (byte, flags) in flags.as_chunks::<8>().0.iter().enumerate() {
        // The product moves the lowest bit of each byte into the uppermost byte.
        let flags = u64::from_le_bytes(flags.map(u8::from));
        bits |= (flags.wrapping_mul(0x0102_0408_1020_4080) >> 56) << (8 * byte);
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile_simulation::Random;

    #[test]
    fn bits_of_states_are_exact_where_rounding_hides_a_difference() {
        let (mut palette, mut random) = (Palette::default(), Random::of(9, &[]));
        let near_0_1 = |ulps: i64| f64::from_bits((0.1_f64.to_bits() as i64 + ulps) as u64);
        let log_odds =
            [-3.5, -0.0, 0.0, 2.0, near_0_1(-1), 0.1, near_0_1(1), near_0_1(1 << 40), 1e-300, f64::MAX];
        let states: Vec<StateId> = log_odds
            .map(|log_odds| palette.intern(Evidence { log_odds, observation_count: 1 }).unwrap())
            .to_vec();
        for threshold in [0.0, -0.0, 0.1, near_0_1(1), 1e-320, f64::INFINITY, f64::NEG_INFINITY, f64::MAX] {
            for _ in 0..20 {
                let cell: [StateId; CELL_VOXELS] =
                    std::array::from_fn(|_| states[random.below(states.len() as u64) as usize]);
                let is_from = |(bit, &state): (usize, &StateId)| {
                    u64::from(palette.evidence(state).log_odds >= threshold) << bit
                };
                let naive = cell.iter().enumerate().map(is_from).fold(0, |bits, bit| bits | bit);
                assert_eq!(bits_of_states(&cell, threshold, &palette), naive, "{threshold}");
            }
        }
    }
}
