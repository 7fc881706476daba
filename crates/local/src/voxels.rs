use super::slab::Slab;
use super::tree::NONE;

/// A stored voxel, linked into the history: it is occupied or not yet known to be free.
#[derive(Clone, Copy, Debug)]
pub(super) struct Voxel {
    /// Clamped sum of the evidence so far.
    pub(super) log_odds: f64,
    block: u32,
    /// Number of the voxel updated before it.
    older: u32,
    /// Number of the voxel updated after it.
    newer: u32,
    /// Position in the block (6 bits), and the number of the voxel's evidence in the current scan (26 bits).
    place_and_touch: u32,
}

/// Maximum number of stored voxels, including a new one for each point of a scan. All of them may get evidence in one
/// scan.
pub(super) const MAX_NUMBERED: usize = NO_TOUCH as usize;

/// Marks missing evidence, in 26 bits.
const NO_TOUCH: u32 = u32::MAX >> 6;

impl Default for Voxel {
    fn default() -> Self {
        Self::new(0, 0, 0.0)
    }
}

impl Voxel {
    pub(super) fn new(block: u32, place: usize, log_odds: f64) -> Self {
        let place_and_touch = place as u32 | NO_TOUCH << 6;
        Self { log_odds, block, older: NONE, newer: NONE, place_and_touch }
    }

    /// Returns the number of the voxel's block and its position there.
    #[inline]
    pub(super) fn home(&self) -> (u32, usize) {
        (self.block, (self.place_and_touch & 63) as usize)
    }

    /// Returns the number of the voxel's evidence in the current scan.
    #[inline]
    pub(super) fn touch(&self) -> Option<u32> {
        let touch = self.place_and_touch >> 6;
        (touch != NO_TOUCH).then_some(touch)
    }

    /// Sets the value of [`Voxel::touch`]; it must be below [`MAX_NUMBERED`].
    #[inline]
    pub(super) fn set_touch(&mut self, touch: Option<u32>) {
        self.place_and_touch = self.place_and_touch & 63 | touch.unwrap_or(NO_TOUCH) << 6;
    }
}

/// All stored voxels in the order of their last updates (the history buffer of the paper by La, Kang and Lee): a doubly
/// linked list, so that moving a voxel to the end takes constant time.
#[derive(Clone, Debug)]
pub(super) struct Voxels {
    pub(super) slab: Slab<Voxel>,
    oldest: u32,
    newest: u32,
    len: usize,
}

impl Default for Voxels {
    fn default() -> Self {
        Self { slab: Slab::default(), oldest: NONE, newest: NONE, len: 0 }
    }
}

impl Voxels {
    /// Returns the number of voxels in the history.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Returns the least recently updated voxel.
    pub(super) fn oldest(&self) -> Option<u32> {
        (self.oldest != NONE).then_some(self.oldest)
    }

    /// Appends a voxel that is not in the history.
    pub(super) fn push_newest(&mut self, id: u32) {
        let last = std::mem::replace(&mut self.newest, id);
        let voxel = self.slab.get_mut(id);
        (voxel.older, voxel.newer) = (last, NONE);
        match last {
            NONE => self.oldest = id,
            last => self.slab.get_mut(last).newer = id,
        }
        self.len += 1;
    }

    /// Prepends a voxel that is not in the history.
    pub(super) fn push_oldest(&mut self, id: u32) {
        let first = std::mem::replace(&mut self.oldest, id);
        let voxel = self.slab.get_mut(id);
        (voxel.older, voxel.newer) = (NONE, first);
        match first {
            NONE => self.newest = id,
            first => self.slab.get_mut(first).older = id,
        }
        self.len += 1;
    }

    /// Removes a voxel from the history.
    pub(super) fn unlink(&mut self, id: u32) {
        let Voxel { older, newer, .. } = *self.slab.get(id);
        match older {
            NONE => self.oldest = newer,
            older => self.slab.get_mut(older).newer = newer,
        }
        match newer {
            NONE => self.newest = older,
            newer => self.slab.get_mut(newer).older = older,
        }
        self.len -= 1;
    }

    /// Returns the history, oldest first.
    pub(super) fn in_order(&self) -> impl Iterator<Item = &Voxel> {
        let mut next = self.oldest;
        std::iter::from_fn(move || {
            let voxel = (next != NONE).then(|| self.slab.get(next))?;
            next = voxel.newer;
            Some(voxel)
        })
    }
}
