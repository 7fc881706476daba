use super::cells::CELL_VOXELS;
use super::miss_runs::MissRuns;
use crate::sensor::{Evidence, Observation, SensorModel};

/// Number of a state in a [`Palette`].
pub(crate) type StateId = u16;

/// State of an unobserved voxel. As a *next* state it means that the step was not computed yet: no update leads back to
/// it.
pub(crate) const UNKNOWN: StateId = 0;

/// Distinct states of evidence of a tile's voxels, each stored once, with the steps between them.
///
/// Voxels with the same history have the same evidence, and most voxels share a few histories: a tile of a million
/// voxels has some hundreds of states. A step (state, observation) -> state is a pure function, so it is computed once
/// and looked up from then on: an update is one read and one write of two bytes.
///
/// The number of states is limited. The limit depends on the number in use, so that unused states do not accumulate: at
/// the limit the owner calls [`retain`](Palette::retain) with the states in use.
#[derive(Clone, Debug)]
pub(crate) struct Palette {
    model: SensorModel,
    /// A miss never raises log-odds above this value.
    max_after_miss: f32,
    evidence: Vec<Evidence>,
    next: Vec<Next>,
    /// Log-odds as `f32`, as in the octree; negative infinity for unknown voxels.
    values: Vec<f32>,
    /// Hash table of the states by evidence, with open addressing; [`UNKNOWN`] marks a free slot.
    slots: Vec<StateId>,
    /// Number of states at which unused ones are dropped; at most `max_states`.
    limit: usize,
    max_states: usize,
    renumberings: u64,
}

/// State after an observation, or [`UNKNOWN`].
#[derive(Clone, Copy, Debug, Default)]
struct Next {
    miss: StateId,
    hit: StateId,
}

/// Error: the palette is full.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Full;

const FIRST_LIMIT: usize = 1 << 10;
const MAX_STATES: usize = 1 << 16;

fn max_after_miss(model: &SensorModel) -> f32 {
    (model.max_after_miss() as f32).next_up()
}

impl Default for Palette {
    fn default() -> Self {
        Self::limited(FIRST_LIMIT, MAX_STATES)
    }
}

impl Palette {
    /// Creates a palette with an initial limit of `limit` states and a maximum of `max_states`; both must be powers of two.
    pub(crate) fn limited(limit: usize, max_states: usize) -> Self {
        let model = SensorModel::default();
        Self {
            model,
            max_after_miss: max_after_miss(&model),
            evidence: vec![Evidence::PRIOR],
            next: vec![Next::default()],
            values: vec![f32::NEG_INFINITY],
            slots: Vec::new(),
            limit,
            max_states,
            renumberings: 0,
        }
    }

    /// Creates a palette with the largest limit, until [`limit_by_use`](Self::limit_by_use) is called.
    pub(crate) fn with_max_limit() -> Self {
        Self::limited(MAX_STATES, MAX_STATES)
    }

    /// Sets the limit that would result if the states had been added one by one.
    pub(crate) fn limit_by_use(&mut self) {
        self.limit = (2 * self.len()).next_power_of_two().clamp(FIRST_LIMIT, self.max_states);
    }

    /// Sensor model that computes the steps.
    pub(crate) fn model(&self) -> &SensorModel {
        &self.model
    }

    /// Sets the sensor model. If it differs, known steps are dropped.
    pub(crate) fn use_model(&mut self, model: &SensorModel) {
        if self.model != *model {
            self.model = *model;
            self.max_after_miss = max_after_miss(model);
            self.next.fill(Next::default());
        }
    }

    /// A miss never raises log-odds above this value.
    #[inline]
    pub(crate) fn max_after_miss(&self) -> f32 {
        self.max_after_miss
    }

    /// Number of states, including the unknown state.
    pub(crate) fn len(&self) -> usize {
        self.evidence.len()
    }

    pub(crate) fn bytes(&self) -> usize {
        self.evidence.capacity() * size_of::<Evidence>()
            + self.next.capacity() * size_of::<Next>()
            + self.values.capacity() * size_of::<f32>()
            + self.slots.capacity() * size_of::<StateId>()
    }

    #[inline]
    pub(crate) fn evidence(&self, state: StateId) -> Evidence {
        self.evidence[usize::from(state)]
    }

    /// Log-odds of states as `f32`; negative infinity for unknown voxels.
    #[inline]
    pub(crate) fn values(&self, states: &[StateId; CELL_VOXELS]) -> [f32; CELL_VOXELS] {
        states.map(|state| self.values[usize::from(state)])
    }

    /// For each state number, whether the state is of an observed voxel and satisfies `holds`.
    pub(crate) fn states_with(&self, holds: impl Fn(Evidence) -> bool) -> Vec<bool> {
        let mut states: Vec<bool> = self.evidence.iter().map(|&evidence| holds(evidence)).collect();
        states[usize::from(UNKNOWN)] = false;
        states
    }

    #[inline]
    pub(crate) fn after_miss(&mut self, before: StateId) -> Result<StateId, Full> {
        match self.next[usize::from(before)].miss {
            UNKNOWN => self.first_miss(before),
            after => Ok(after),
        }
    }

    /// State after a number of misses.
    #[inline]
    pub(crate) fn after_misses(
        &mut self,
        before: StateId,
        misses: u16,
        known: &mut MissRuns,
    ) -> Result<StateId, Full> {
        if let Some(after) = known.get(before, misses) {
            return Ok(after);
        }
        let after = self.intern(self.model.update_misses(self.evidence(before), misses))?;
        known.put(before, misses, after);
        Ok(after)
    }

    #[inline]
    pub(crate) fn after_hit(&mut self, before: StateId, intensity: f32) -> Result<StateId, Full> {
        match self.next[usize::from(before)].hit {
            UNKNOWN => self.first_hit(before, intensity),
            after => Ok(after),
        }
    }

    #[cold]
    #[inline(never)]
    fn first_miss(&mut self, before: StateId) -> Result<StateId, Full> {
        let after = self.intern(self.model.update(Some(self.evidence(before)), Observation::Miss))?;
        self.next[usize::from(before)].miss = after;
        Ok(after)
    }

    #[inline(never)]
    fn first_hit(&mut self, before: StateId, intensity: f32) -> Result<StateId, Full> {
        let hit = Observation::Hit(intensity);
        let after = self.intern(self.model.update(Some(self.evidence(before)), hit))?;
        // If the model uses the intensity, the state after a hit depends on it and cannot be cached.
        if !self.model.needs_intensity() {
            self.next[usize::from(before)].hit = after;
        }
        Ok(after)
    }

    /// State with this evidence, if it exists.
    pub(crate) fn find(&self, evidence: Evidence) -> Option<StateId> {
        if self.slots.is_empty() {
            return None;
        }
        let mut slot = self.slot_of(evidence);
        loop {
            match self.slots[slot] {
                UNKNOWN => return None,
                state if is_same(self.evidence(state), evidence) => return Some(state),
                _ => slot = (slot + 1) & (self.slots.len() - 1),
            }
        }
    }

    /// State with this evidence; created if it does not exist.
    pub(crate) fn intern(&mut self, evidence: Evidence) -> Result<StateId, Full> {
        if 4 * self.len() >= 3 * self.slots.len() {
            self.rehash();
        }
        let mut slot = self.slot_of(evidence);
        loop {
            match self.slots[slot] {
                UNKNOWN => break,
                state if is_same(self.evidence(state), evidence) => return Ok(state),
                _ => slot = (slot + 1) & (self.slots.len() - 1),
            }
        }
        if self.len() >= self.limit {
            return Err(Full);
        }
        let state = self.len() as StateId;
        self.evidence.push(evidence);
        self.next.push(Next::default());
        self.values.push(evidence.log_odds as f32);
        self.slots[slot] = state;
        Ok(state)
    }

    /// Drops unused states. Returns the new number of each state, [`UNKNOWN`] for dropped ones. If most states are in
    /// use, raises the limit.
    pub(crate) fn retain(&mut self, in_use: &[bool]) -> Vec<StateId> {
        let mut kept = 0;
        let number = |(state, &in_use): (usize, &bool)| {
            let stays = in_use && state != usize::from(UNKNOWN);
            kept += StateId::from(stays);
            if stays { kept } else { UNKNOWN }
        };
        let numbers: Vec<StateId> = in_use.iter().enumerate().map(number).collect();
        let stays = |state: usize| state == usize::from(UNKNOWN) || numbers[state] != UNKNOWN;
        let renumbered =
            |next: &Next| Next { miss: numbers[usize::from(next.miss)], hit: numbers[usize::from(next.hit)] };
        self.next =
            (0..self.len()).filter(|&state| stays(state)).map(|s| renumbered(&self.next[s])).collect();
        self.evidence = (0..self.len()).filter(|&state| stays(state)).map(|s| self.evidence[s]).collect();
        self.values = self.evidence.iter().map(|evidence| evidence.log_odds as f32).collect();
        self.values[usize::from(UNKNOWN)] = f32::NEG_INFINITY;
        if self.len() > self.limit / 2 {
            self.limit = (self.limit * 2).min(self.max_states);
        }
        self.rehash();
        self.renumberings += 1;
        numbers
    }

    /// Number of times that states were renumbered.
    pub(crate) fn renumberings(&self) -> u64 {
        self.renumberings
    }

    /// Returns whether another state can be added.
    pub(crate) fn has_room(&self) -> bool {
        self.len() < self.limit
    }

    pub(crate) fn can_grow(&self) -> bool {
        self.limit < self.max_states
    }

    /// Rebuilds the hash table, at most half full.
    fn rehash(&mut self) {
        self.slots = vec![UNKNOWN; (2 * self.len()).next_power_of_two().max(16)];
        for state in 1..self.len() {
            let mut slot = self.slot_of(self.evidence[state]);
            while self.slots[slot] != UNKNOWN {
                slot = (slot + 1) & (self.slots.len() - 1);
            }
            self.slots[slot] = state as StateId;
        }
    }

    fn slot_of(&self, evidence: Evidence) -> usize {
        let bits = evidence.log_odds.to_bits() ^ (evidence.observation_count as u64).rotate_left(20);
        // Fibonacci hashing: the upper bits of the product depend on all bits.
        let hash = (bits ^ bits >> 29).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
        ((hash * self.slots.len() as u64) >> 32) as usize
    }
}

/// Returns whether both are bit-identical.
fn is_same(a: Evidence, b: Evidence) -> bool {
    a.log_odds.to_bits() == b.log_odds.to_bits() && a.observation_count == b.observation_count
}
