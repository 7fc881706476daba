use super::far_bricks::FarBricks;
use crate::scan::clearing::{AROUND, BrickCells, Marks, MarksAround, Step, moved, near_set};
use crate::scan::pages::{MarkedBrick, MarkedPage, PAGE_BRICKS, PageMap, brick_in_page};
use crate::space::{BRICK_EDGE, BrickMask, VoxelIndex, is_in_mask, place_of_voxel, places};
use rayon::prelude::*;

/// Marks of a whole scan in pages and, outside the window, in bricks.
pub(crate) struct PageMarks<'a> {
    pages: &'a PageMap<MarkedPage>,
    far: &'a FarBricks,
    /// By page.
    cells: Vec<PageCells>,
    /// By page: the bricks with hits, and their 26 neighbors.
    near_hits: Vec<BrickMask>,
    /// By page.
    around: Vec<PagesAround>,
}

/// Cells of the marked bricks of a page.
struct PageCells {
    /// By brick, in Morton order: its number in `cells`; 0 without marks.
    numbers: Box<[u16; PAGE_BRICKS]>,
    /// The first one is empty.
    cells: Vec<BrickCells>,
}

impl PageCells {
    fn of(page: &MarkedPage, index: VoxelIndex) -> Self {
        let (mut numbers, mut cells) = (Box::new([0; PAGE_BRICKS]), vec![BrickCells::default()]);
        for place in places(page.found()) {
            let (hits, passed) = page.brick(place);
            numbers[place] = cells.len() as u16;
            cells.push(BrickCells::of(&MarkedBrick {
                index: brick_in_page(index, place as u32),
                hits,
                passed,
            }));
        }
        Self { numbers, cells }
    }

    #[inline]
    fn at(&self, place: usize) -> &BrickCells {
        &self.cells[usize::from(self.numbers[place % PAGE_BRICKS])]
    }
}

impl<'a> PageMarks<'a> {
    pub(crate) fn new(pages: &'a PageMap<MarkedPage>, far: &'a FarBricks) -> Self {
        let numbered = || pages.pages().par_iter().zip(pages.indices());
        let hit_bricks: Vec<BrickMask> = pages.pages().iter().map(MarkedPage::hit_bricks).collect();
        let around: Vec<PagesAround> = numbered().map(|(_, &index)| PagesAround::new(pages, index)).collect();
        let near_hits = around
            .par_iter()
            .map(|around| near_set(AROUND, |step| around.at(step).map_or([0; 8], |page| hit_bricks[page])));
        let near_hits = near_hits.collect();
        let cells = numbered().map(|(page, &index)| PageCells::of(page, index)).collect();
        Self { pages, far, cells, near_hits, around }
    }
}

impl Marks for PageMarks<'_> {
    #[inline]
    fn around(&self, brick: VoxelIndex) -> impl MarksAround {
        let page = self.pages.find(brick.map(|k| k.div_euclid(BRICK_EDGE)));
        let steps = std::array::from_fn(|axis| &STEPS[axis][(brick[axis] & 7) as usize]);
        PageMarksAround { marks: self, brick, page, steps }
    }
}

/// Numbers of a page and of the 26 pages around it, plus one; 0 where there is no page.
struct PagesAround([u32; 27]);

impl PagesAround {
    fn new(pages: &PageMap<MarkedPage>, index: VoxelIndex) -> Self {
        let page_at = |place: usize| {
            let place = place as i32;
            pages.find(moved(index, [place % 3 - 1, place / 3 % 3 - 1, place / 9 - 1]))
        };
        Self(std::array::from_fn(|place| page_at(place).map_or(0, |page| page as u32 + 1)))
    }

    /// The number of the page at a step.
    #[inline]
    fn at(&self, [x, y, z]: Step) -> Option<usize> {
        self.number((13 + x + 3 * y + 9 * z) as usize)
    }

    #[inline]
    fn number(&self, place: usize) -> Option<usize> {
        (self.0[place] as usize).checked_sub(1)
    }
}

/// Along an axis: what the three steps from a brick of a page add to two positions.
struct AxisSteps {
    /// To the position in [`PagesAround`]. The fourth value is unused; with it, an index needs no check.
    page: [u8; 4],
    /// To the brick's Morton position in its page.
    place: [u16; 4],
}

/// By axis and index of the brick in its page.
static STEPS: [[AxisSteps; 8]; 3] = [axis_steps(0), axis_steps(1), axis_steps(2)];

const fn axis_steps(axis: usize) -> [AxisSteps; 8] {
    let mut steps = [const { AxisSteps { page: [0; 4], place: [0; 4] } }; 8];
    let mut from = 0;
    while from < 8 {
        let mut step = 0;
        while step < 3 {
            // A page has as many bricks along an axis as a brick has voxels.
            let to = from as i32 + step as i32 - 1;
            let page = (to + BRICK_EDGE) / BRICK_EDGE;
            steps[from].page[step] = page as u8 * [1, 3, 9][axis];
            steps[from].place[step] = (place_of_voxel([to & 7, 0, 0]) << axis) as u16;
            step += 1;
        }
        from += 1;
    }
    steps
}

struct PageMarksAround<'a> {
    marks: &'a PageMarks<'a>,
    brick: VoxelIndex,
    /// Page of the brick; `None` outside the window.
    page: Option<usize>,
    steps: [&'static AxisSteps; 3],
}

impl PageMarksAround<'_> {
    /// The page of the brick at a step, and the brick's position in it.
    #[inline(always)]
    fn find(&self, step: Step) -> Option<(usize, usize)> {
        let [x, y, z] = step.map(|step| (step + 1) as usize & 3);
        let [along_x, along_y, along_z] = self.steps;
        let place = along_x.place[x] | along_y.place[y] | along_z.place[z];
        let page = match self.page {
            Some(page) => self.marks.around[page]
                .number(usize::from(along_x.page[x] + along_y.page[y] + along_z.page[z])),
            None => self.marks.pages.find(moved(self.brick, step).map(|k| k.div_euclid(BRICK_EDGE))),
        };
        Some((page?, usize::from(place)))
    }

    /// The brick at a step, if it is outside the window.
    fn far(&self, step: Step) -> Option<&MarkedBrick> {
        if self.marks.far.is_empty() { None } else { self.marks.far.get(moved(self.brick, step)) }
    }
}

impl MarksAround for PageMarksAround<'_> {
    #[inline]
    fn hits(&self, step: Step) -> BrickMask {
        match self.find(step) {
            Some((page, place)) => self.marks.pages.pages()[page].hits_at(place),
            None => self.far(step).map_or([0; 8], |marked| marked.hits),
        }
    }

    #[inline]
    fn misses(&self, step: Step) -> BrickMask {
        match self.find(step) {
            Some((page, place)) => self.marks.pages.pages()[page].misses_at(place),
            None => self.far(step).map_or([0; 8], MarkedBrick::misses),
        }
    }

    #[inline]
    fn cells(&self, step: Step) -> BrickCells {
        match self.find(step) {
            Some((page, place)) => *self.marks.cells[page].at(place),
            None => self.far(step).map_or_else(BrickCells::default, BrickCells::of),
        }
    }

    #[inline]
    fn hit_cells(&self, step: Step) -> u64 {
        match self.find(step) {
            Some((page, place)) => self.marks.cells[page].at(place).hit,
            None => self.far(step).map_or(0, |marked| BrickCells::of(marked).hit),
        }
    }

    fn may_have_hits(&self) -> bool {
        // Bricks outside the window are not in the sets.
        !self.marks.far.is_empty()
            || self
                .page
                .is_none_or(|page| is_in_mask(&self.marks.near_hits[page], place_of_voxel(self.brick)))
    }
}
