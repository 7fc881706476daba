use super::far_bricks::FarBricks;
use crate::scan::clearing::{BrickCells, Marks, near_set};
use crate::scan::pages::{MarkedBrick, MarkedPage, PageMap, brick_in_page};
use crate::space::{BRICK_EDGE, BrickMask, VoxelIndex, is_in_mask, place_of_voxel, places};
use rayon::prelude::*;

/// Marks of a whole scan in pages and, outside the window, in bricks.
pub(crate) struct PageMarks<'a> {
    pages: &'a PageMap<MarkedPage>,
    far: &'a FarBricks,
    /// By page.
    cells: Vec<PageCells>,
    /// By page: the bricks that are hit or have one of their 26 neighbors hit.
    near_hits: Vec<BrickMask>,
}

/// Cells of the marked bricks of a page, in Morton order of the bricks.
struct PageCells {
    found: BrickMask,
    /// Number of bricks before each word of `found`.
    before: [u16; 8],
    cells: Vec<BrickCells>,
}

impl PageCells {
    fn of(page: &MarkedPage, index: VoxelIndex) -> Self {
        let found = page.found();
        let mut before = [0; 8];
        for word in 1..8 {
            before[word] = before[word - 1] + found[word - 1].count_ones() as u16;
        }
        let cells = places(found).map(|place| {
            let (hits, passed) = page.brick(place);
            BrickCells::of(&MarkedBrick { index: brick_in_page(index, place as u32), hits, passed })
        });
        Self { found, before, cells: cells.collect() }
    }

    #[inline]
    fn at(&self, place: usize) -> BrickCells {
        let (word, bit) = (place / 64, place % 64);
        if self.found[word] >> bit & 1 == 0 {
            return BrickCells::default();
        }
        let earlier = (self.found[word] & !(u64::MAX << bit)).count_ones();
        self.cells[usize::from(self.before[word]) + earlier as usize]
    }
}

impl<'a> PageMarks<'a> {
    pub(crate) fn new(pages: &'a PageMap<MarkedPage>, far: &'a FarBricks) -> Self {
        let numbered = || pages.pages().par_iter().zip(pages.indices());
        let hit_bricks: Vec<BrickMask> = pages.pages().iter().map(MarkedPage::hit_bricks).collect();
        let cells = numbered().map(|(page, &index)| PageCells::of(page, index)).collect();
        let near_hits = numbered()
            .map(|(_, &index)| {
                near_set(index, |page| pages.find(page).map_or([0; 8], |page| hit_bricks[page]))
            })
            .collect();
        Self { pages, far, cells, near_hits }
    }

    /// The page of a brick, and the brick's position in it.
    #[inline(always)]
    fn find(&self, brick: VoxelIndex) -> Option<(usize, usize)> {
        let page = self.pages.find(brick.map(|k| k.div_euclid(BRICK_EDGE)))?;
        Some((page, place_of_voxel(brick)))
    }
}

impl Marks for PageMarks<'_> {
    fn hits(&self, brick: VoxelIndex) -> BrickMask {
        match self.find(brick) {
            Some((page, place)) => self.pages.pages()[page].hits_at(place),
            None => self.far.get(brick).map_or([0; 8], |marked| marked.hits),
        }
    }

    fn misses(&self, brick: VoxelIndex) -> BrickMask {
        match self.find(brick) {
            Some((page, place)) => self.pages.pages()[page].misses_at(place),
            None => self.far.get(brick).map_or([0; 8], MarkedBrick::misses),
        }
    }

    fn cells(&self, brick: VoxelIndex) -> BrickCells {
        match self.find(brick) {
            Some((page, place)) => self.cells[page].at(place),
            None => self.far.get(brick).map_or_else(BrickCells::default, BrickCells::of),
        }
    }

    fn may_be_near_hits(&self, brick: VoxelIndex) -> bool {
        // Bricks outside the window are not in the sets.
        !self.far.is_empty()
            || self.find(brick).is_none_or(|(page, place)| is_in_mask(&self.near_hits[page], place))
    }
}
