use super::palette::StateId;

/// Where runs of misses lead, as far as it was found out lately: of many misses the states on the way are seldom met
/// again, but runs of equally many are, since the voxels beside each other are passed by equally many rays.
///
/// It holds as long as the states keep their numbers.
pub(crate) struct MissRuns(Vec<Entry>);

#[derive(Clone, Copy)]
struct Entry {
    before: StateId,
    misses: u16,
    after: StateId,
}

/// No run has no misses.
const NONE: Entry = Entry { before: 0, misses: 0, after: 0 };
const ENTRIES: usize = 1 << 11;

impl MissRuns {
    pub(crate) fn new() -> Self {
        Self(vec![NONE; ENTRIES])
    }

    /// Forgets all.
    pub(crate) fn clear(&mut self) {
        self.0.fill(NONE);
    }

    /// The state after `misses`, at least one.
    #[inline]
    pub(crate) fn get(&self, before: StateId, misses: u16) -> Option<StateId> {
        let entry = &self.0[place(before, misses)];
        (entry.before == before && entry.misses == misses && misses > 0).then_some(entry.after)
    }

    #[inline]
    pub(crate) fn put(&mut self, before: StateId, misses: u16, after: StateId) {
        self.0[place(before, misses)] = Entry { before, misses, after };
    }
}

/// Different for the runs of different lengths from one state.
#[inline]
fn place(before: StateId, misses: u16) -> usize {
    usize::from(before.wrapping_mul(0x9e35) ^ misses) % ENTRIES
}
