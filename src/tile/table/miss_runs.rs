use super::palette::StateId;

/// Cache of the state that a voxel has after a run of misses. Adjacent voxels are passed by equally many rays, so the
/// same runs often recur. The states within a run do not.
///
/// Valid as long as the states keep their numbers.
pub(crate) struct MissRuns(Vec<Entry>);

#[derive(Clone, Copy)]
struct Entry {
    before: StateId,
    misses: u16,
    after: StateId,
}

/// Matches no run, because a run has at least one miss.
const NONE: Entry = Entry { before: 0, misses: 0, after: 0 };
const ENTRIES: usize = 1 << 11;

impl MissRuns {
    pub(crate) fn new() -> Self {
        Self(vec![NONE; ENTRIES])
    }

    pub(crate) fn clear(&mut self) {
        self.0.fill(NONE);
    }

    /// The cached state after `misses`, at least one.
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

/// Index of a run; differs for runs of different lengths from one state.
#[inline]
fn place(before: StateId, misses: u16) -> usize {
    usize::from(before.wrapping_mul(0x9e35) ^ misses) % ENTRIES
}
