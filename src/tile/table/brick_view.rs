use super::brick::Brick;
use super::palette::Palette;
use crate::sensor::Evidence;
use crate::space::{BrickCode, BrickMask};

/// View of a brick of a table, for reading many of its voxels.
#[derive(Clone, Copy)]
pub(crate) struct BrickView<'a> {
    pub(super) brick: &'a Brick,
    pub(super) palette: &'a Palette,
}

impl BrickView<'_> {
    /// Evidence of a voxel by its position; `None` if it was never observed.
    #[inline]
    pub(crate) fn get(&self, place: usize) -> Option<Evidence> {
        self.brick.get(place, self.palette)
    }

    #[inline]
    pub(crate) fn is_observed(&self, place: usize) -> bool {
        self.brick.observed[place / 64] >> (place % 64) & 1 == 1
    }

    /// Code of the brick.
    pub(crate) fn code(&self) -> BrickCode {
        self.brick.code()
    }

    pub(crate) fn observed(&self) -> BrickMask {
        self.brick.observed
    }

    /// Mask of the observed voxels whose log-odds are at least a threshold.
    pub(crate) fn mask_from(&self, log_odds: f64) -> BrickMask {
        self.brick.mask_from(log_odds, self.palette)
    }

    /// One word of [`BrickView::mask_from`]: an octant of the brick.
    pub(crate) fn word_from(&self, word: usize, log_odds: f64) -> u64 {
        self.brick.word_from(word, log_odds, self.palette)
    }

    /// Returns whether all log-odds are known to be below a threshold.
    #[inline]
    pub(crate) fn is_below(&self, log_odds: f64) -> bool {
        self.brick.is_below(log_odds)
    }
}
