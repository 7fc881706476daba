use super::brick::Brick;
use super::palette::Palette;
use crate::sensor::Evidence;
use crate::space::BrickMask;

/// A brick of a table, to look at many of its voxels.
#[derive(Clone, Copy)]
pub(crate) struct BrickLook<'a> {
    pub(super) brick: &'a Brick,
    pub(super) palette: &'a Palette,
}

impl BrickLook<'_> {
    /// The evidence of the voxel at a place; `None` if it was never observed.
    #[inline]
    pub(crate) fn get(&self, place: usize) -> Option<Evidence> {
        self.brick.get(place, self.palette)
    }

    /// Whether the voxel at a place was observed.
    #[inline]
    pub(crate) fn is_observed(&self, place: usize) -> bool {
        self.brick.observed[place / 64] >> (place % 64) & 1 == 1
    }

    /// The observed voxels.
    pub(crate) fn observed(&self) -> BrickMask {
        self.brick.observed
    }

    /// The observed voxels whose log-odds are at least a threshold.
    pub(crate) fn mask_from(&self, log_odds: f64) -> BrickMask {
        self.brick.mask_from(log_odds, self.palette)
    }

    /// One word of [`BrickLook::mask_from`]: an octant of the brick.
    pub(crate) fn word_from(&self, word: usize, log_odds: f64) -> u64 {
        self.brick.word_from(word, log_odds, self.palette)
    }

    /// Whether no voxel is known to have log-odds of a threshold or more.
    #[inline]
    pub(crate) fn is_below(&self, log_odds: f64) -> bool {
        self.brick.is_below(log_odds)
    }
}
