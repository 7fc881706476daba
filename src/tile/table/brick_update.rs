use super::brick::{Brick, Storage};
use super::cells::Cells;
use super::miss_runs::MissRuns;
use super::palette::{Full, Palette, StateId, UNKNOWN};
use super::unpadded_evidence::UnpaddedEvidence;
use crate::scan::{BrickRuns, BrickUpdate, Misses};
use crate::sensor::{Evidence, Observation, SensorModel};
use crate::space::{BrickMask, places};

/// Part of a brick's update that is not applied yet.
pub(crate) struct Rest<'a> {
    hits: BrickMask,
    misses: BrickMask,
    /// Misses that do not change observed voxels.
    weak: BrickMask,
    /// Intensities of the remaining hits, in order; empty for sensor models that need none.
    intensities: &'a [f32],
}

impl<'a> Rest<'a> {
    pub(crate) fn of(update: &'a BrickUpdate) -> Self {
        let misses = std::array::from_fn(|word| update.misses[word] & !update.hits[word]);
        Self { hits: update.hits, misses, weak: update.weak, intensities: &update.intensities }
    }

    pub(crate) fn of_voxel(place: usize, observation: &'a Observation) -> Self {
        let mut mask = [0; 8];
        mask[place / 64] = 1 << (place % 64);
        match observation {
            Observation::Miss => Self { hits: [0; 8], misses: mask, weak: [0; 8], intensities: &[] },
            Observation::Hit(intensity) => {
                let intensities = std::slice::from_ref(intensity);
                Self { hits: mask, misses: [0; 8], weak: [0; 8], intensities }
            }
        }
    }

    /// Set of words with remaining updates: bit `k` for word `k`.
    fn words(&self) -> u8 {
        (0..8).fold(0, |words, word| words | u8::from(self.hits[word] | self.misses[word] != 0) << word)
    }
}

impl Brick {
    /// Applies an update. Returns the number of voxels observed for the first time. If the palette is full, the
    /// remainder is left in `rest`; the caller frees states, or makes the brick plain, and calls this again.
    pub(crate) fn update(&mut self, rest: &mut Rest<'_>, palette: &mut Palette) -> (usize, Result<(), Full>) {
        for word in 0..8 {
            rest.misses[word] &= !(rest.weak[word] & self.observed[word]);
        }
        // Not `hits != [0; 8]`, because comparing arrays would call a function.
        let has_hits = rest.hits.iter().fold(0, |all, word| all | word) != 0;
        self.summary.note_change(if has_hits { f32::INFINITY } else { palette.max_after_miss() });
        match &mut self.evidence {
            Storage::Interned(cells) => update_interned(cells, &mut self.observed, rest, palette),
            Storage::Plain(cells) => (update_plain(cells, &mut self.observed, rest, palette.model()), Ok(())),
        }
    }

    /// Applies one update of one voxel whose cell exists. Returns whether the voxel is observed for the first time;
    /// `None`, without an update, if the palette is full.
    #[inline]
    pub(crate) fn update_one(
        &mut self,
        place: usize,
        observation: Observation,
        palette: &mut Palette,
    ) -> Option<bool> {
        let bound = match observation {
            Observation::Miss => palette.max_after_miss(),
            Observation::Hit(_) => f32::INFINITY,
        };
        self.step(place, bound, |before| match observation {
            Observation::Miss => palette.after_miss(before),
            Observation::Hit(intensity) => palette.after_hit(before, intensity),
        })
    }

    /// Applies runs and removes them from the list. Stops early if the palette is full or the brick does not use the
    /// palette. Returns the number of voxels observed for the first time.
    pub(crate) fn update_runs(
        &mut self,
        left: &mut BrickRuns<'_>,
        palette: &mut Palette,
        known: &mut MissRuns,
    ) -> usize {
        let has_hits = left.runs.iter().any(|run| run.hit.is_some());
        self.summary.note_change(if has_hits { f32::INFINITY } else { palette.max_after_miss() });
        let Storage::Interned(cells) = &mut self.evidence else { return 0 };
        let word_of = |place: u16| 1 << (place / 64);
        let of_runs = left.runs.iter().fold(0, |words, run| words | word_of(run.place));
        cells.make(left.misses.iter().fold(of_runs, |words, misses| words | word_of(misses.place)), UNKNOWN);
        let mut new = 0;
        while let Some((run, later)) = left.runs.split_first() {
            let (word, bit) = (usize::from(run.place / 64), usize::from(run.place % 64));
            let state = &mut cells.cell_mut(word).expect(MADE)[bit];
            let before = *state;
            let missed =
                if run.misses == 0 { Ok(before) } else { palette.after_misses(before, run.misses, known) };
            let after = missed.and_then(|missed| match run.hit {
                Some(intensity) => palette.after_hit(missed, intensity),
                None => Ok(missed),
            });
            let Ok(after) = after else { return new };
            *state = after;
            // No update leads to the unknown state, and no run is empty.
            self.observed[word] |= u64::from(after != UNKNOWN) << bit;
            new += usize::from(before == UNKNOWN && after != UNKNOWN);
            left.runs = later;
        }
        new + update_misses(cells, &mut self.observed, &mut left.misses, palette, known)
    }

    #[inline]
    fn step(
        &mut self,
        place: usize,
        bound: f32,
        after: impl FnOnce(StateId) -> Result<StateId, Full>,
    ) -> Option<bool> {
        let (word, bit) = (place / 64, place % 64);
        let Storage::Interned(cells) = &mut self.evidence else { return None };
        let state = &mut cells.cell_mut(word)?[bit];
        let before = *state;
        *state = after(before).ok()?;
        self.summary.note_change(bound);
        let is_new = before == UNKNOWN;
        if is_new {
            self.observed[word] |= 1 << bit;
        }
        Some(is_new)
    }

    /// Inserts voxels that were not observed yet, in Morton order. Returns the number inserted before the palette was
    /// full.
    pub(crate) fn insert(&mut self, voxels: &[(usize, Evidence)], palette: &mut Palette) -> usize {
        for (_, evidence) in voxels {
            self.summary.note_change((evidence.log_odds as f32).next_up());
        }
        let words = voxels.iter().fold(0, |words, (place, _)| words | 1 << (place / 64));
        match &mut self.evidence {
            Storage::Interned(cells) => cells.make(words, UNKNOWN),
            Storage::Plain(cells) => cells.make(words, UnpaddedEvidence::from(Evidence::PRIOR)),
        }
        // Adjacent voxels often have the same state.
        let mut last = (Evidence::PRIOR, UNKNOWN);
        for (done, &(place, evidence)) in voxels.iter().enumerate() {
            let (word, bit) = (place / 64, place % 64);
            match &mut self.evidence {
                Storage::Interned(cells) => {
                    if last.1 == UNKNOWN || !is_same(last.0, evidence) {
                        let Ok(state) = palette.intern(evidence) else { return done };
                        last = (evidence, state);
                    }
                    cells.cell_mut(word).expect(MADE)[bit] = last.1;
                }
                Storage::Plain(cells) => cells.cell_mut(word).expect(MADE)[bit] = evidence.into(),
            }
            self.observed[word] |= 1 << bit;
        }
        voxels.len()
    }
}

/// Applies misses and removes them from the list. Returns the number of voxels observed for the first time.
fn update_misses(
    cells: &mut Cells<StateId>,
    observed: &mut BrickMask,
    left: &mut &[Misses],
    palette: &mut Palette,
    known: &mut MissRuns,
) -> usize {
    let mut new = 0;
    while let Some(first) = left.first() {
        // The misses of one cell, which is looked up once.
        let word = usize::from(first.place / 64);
        let cell = cells.cell_mut(word).expect(MADE);
        let (mut passed, mut done) = (0_u64, 0);
        let mut is_full = false;
        for &Misses { place, misses } in
            left.iter().take_while(|misses| usize::from(misses.place / 64) == word)
        {
            let state = &mut cell[usize::from(place % 64)];
            // Without misses an unknown voxel remains unknown.
            if misses > 0 {
                let Ok(after) = palette.after_misses(*state, misses, known) else {
                    is_full = true;
                    break;
                };
                *state = after;
                passed |= 1 << (place % 64);
            }
            done += 1;
        }
        new += (passed & !observed[word]).count_ones() as usize;
        observed[word] |= passed;
        *left = &left[done..];
        if is_full {
            break;
        }
    }
    new
}

/// Returns whether both are bit-identical.
#[inline]
fn is_same(a: Evidence, b: Evidence) -> bool {
    a.log_odds.to_bits() == b.log_odds.to_bits() && a.observation_count == b.observation_count
}

const MADE: &str = "the cells of the updated words were created before";

fn update_interned(
    cells: &mut Cells<StateId>,
    observed: &mut BrickMask,
    rest: &mut Rest<'_>,
    palette: &mut Palette,
) -> (usize, Result<(), Full>) {
    let words = rest.words();
    cells.make(words, UNKNOWN);
    let mut new = 0;
    for word in (0..8).filter(|word| words >> word & 1 == 1) {
        let cell = cells.cell_mut(word).expect(MADE);
        let (mut misses, mut hits) = (rest.misses[word], rest.hits[word]);
        let touched = misses | hits;
        let mut result = Ok(());
        // An unobserved voxel needs no special case: its state has a next state like any other.
        while misses != 0 {
            let state = &mut cell[misses.trailing_zeros() as usize];
            match palette.after_miss(*state) {
                Ok(after) => *state = after,
                Err(full) => {
                    result = Err(full);
                    break;
                }
            }
            misses &= misses - 1;
        }
        while hits != 0 && result.is_ok() {
            let state = &mut cell[hits.trailing_zeros() as usize];
            let (intensity, later) = rest.intensities.split_first().map_or((0.0, &[][..]), |(i, l)| (*i, l));
            match palette.after_hit(*state, intensity) {
                Ok(after) => *state = after,
                Err(full) => {
                    result = Err(full);
                    break;
                }
            }
            rest.intensities = later;
            hits &= hits - 1;
        }
        let first = touched & !(misses | hits) & !observed[word];
        if first != 0 {
            observed[word] |= first;
            new += first.count_ones() as usize;
        }
        (rest.misses[word], rest.hits[word]) = (misses, hits);
        if result.is_err() {
            return (new, result);
        }
    }
    (new, Ok(()))
}

fn update_plain(
    cells: &mut Cells<UnpaddedEvidence>,
    observed: &mut BrickMask,
    rest: &mut Rest<'_>,
    model: &SensorModel,
) -> usize {
    cells.make(rest.words(), UnpaddedEvidence::from(Evidence::PRIOR));
    let mut new = 0;
    let mut intensities = rest.intensities.iter();
    for place in places(std::array::from_fn(|word| rest.hits[word] | rest.misses[word])) {
        let (word, bit) = (place / 64, place % 64);
        let observation = if rest.hits[word] >> bit & 1 == 1 {
            Observation::Hit(intensities.next().copied().unwrap_or_default())
        } else {
            Observation::Miss
        };
        let is_known = observed[word] >> bit & 1 == 1;
        let stored = &mut cells.cell_mut(word).expect(MADE)[bit];
        let before = is_known.then(|| Evidence::from(*stored));
        *stored = model.update(before, observation).into();
        observed[word] |= 1 << bit;
        new += usize::from(!is_known);
    }
    (rest.hits, rest.misses) = ([0; 8], [0; 8]);
    new
}
