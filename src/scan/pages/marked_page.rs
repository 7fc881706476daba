use super::footprint::Footprint;
use super::sparse_page::{BrickContent, PAGE_BRICKS, SparsePage, brick_in_page, part_of_place};
use super::window::Local;
use crate::scan::ray::Stretch;
use crate::space::{BRICK_VOXELS, BrickMask, VoxelIndex, places};

/// Page with the voxels that the rays of a scan pass or end in.
#[derive(Clone, Debug, Default)]
pub(crate) struct MarkedPage {
    passed: Marks,
    /// Hits; absent if there are none. Few bricks have hits: those close to ground and walls.
    hits: Option<Box<SparsePage<BrickMask>>>,
    /// Bricks with marks, by position; set by [`MarkedPage::find_bricks`], after which no mark is added.
    found: Option<BrickMask>,
}

#[derive(Clone, Debug)]
enum Marks {
    /// Fast form.
    Words(Words),
    /// Small form, used if memory is short.
    Bricks(Box<SparsePage<BrickMask>>),
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct MarkedBrick {
    /// The indices of its voxels divided by 8.
    pub(crate) index: VoxelIndex,
    /// Voxels in which rays end.
    pub(crate) hits: BrickMask,
    /// Voxels that rays pass, including those that are also hit.
    pub(crate) passed: BrickMask,
}

impl MarkedBrick {
    /// Voxels that rays pass and that are not hit.
    #[inline]
    pub(crate) fn misses(&self) -> BrickMask {
        std::array::from_fn(|word| self.passed[word] & !self.hits[word])
    }
}

/// One bit for each voxel of the page in Morton order, so that eight words are the mask of a brick. Marking a voxel is
/// one operation on one word and needs no look-up of a brick.
#[derive(Clone, Debug)]
struct Words(Box<[u64; WORDS]>);

pub(crate) const WORDS: usize = PAGE_BRICKS * BRICK_VOXELS / 64;

impl Default for Words {
    fn default() -> Self {
        Self(vec![0; WORDS].try_into().expect("as many words"))
    }
}

impl Words {
    #[inline]
    fn mark(&mut self, place: u32) {
        self.0[place as usize / 64 % WORDS] |= 1 << (place % 64);
    }

    /// The mask of each brick, in Morton order.
    fn bricks(&self) -> &[BrickMask] {
        self.0.as_chunks().0
    }

    fn bricks_mut(&mut self) -> &mut [BrickMask] {
        self.0.as_chunks_mut().0
    }

    fn absorb(&mut self, other: &Self) {
        self.0.iter_mut().zip(other.0.iter()).for_each(|(word, other)| *word |= other);
    }
}

/// Masks for a column of four voxels along z, which one word contains. `FROM[k]` contains the voxels from number `k`
/// on; the last mask is empty.
const FROM: [u64; 5] =
    [1 | 1 << 4 | 1 << 32 | 1 << 36, 1 << 4 | 1 << 32 | 1 << 36, 1 << 32 | 1 << 36, 1 << 36, 0];

impl BrickContent for BrickMask {
    const EMPTY: Self = [0; 8];
}

impl Default for Marks {
    fn default() -> Self {
        Self::Words(Words::default())
    }
}

impl Marks {
    fn heap_bytes(&self) -> usize {
        match self {
            Self::Words(_) => size_of::<[u64; WORDS]>(),
            Self::Bricks(bricks) => bytes_of(bricks),
        }
    }

    #[inline]
    fn mark(&mut self, place: u32) {
        match self {
            Self::Words(words) => words.mark(place),
            Self::Bricks(bricks) => mark_small(bricks, place),
        }
    }

    /// Mask of the bricks that have marks.
    fn present(&self) -> BrickMask {
        match self {
            Self::Words(words) => {
                let mut present = [0; 8];
                for (bits, bricks) in present.iter_mut().zip(words.bricks().as_chunks::<64>().0) {
                    let has_marks =
                        |brick: &BrickMask| u64::from(brick.iter().fold(0, |all, word| all | word) != 0);
                    *bits = bricks.iter().rev().fold(0, |bits, brick| bits << 1 | has_marks(brick));
                }
                present
            }
            Self::Bricks(bricks) => present_in(bricks),
        }
    }

    /// Mask of the brick at a position.
    #[inline]
    fn brick(&self, place: usize) -> BrickMask {
        match self {
            Self::Words(words) => words.bricks()[place],
            Self::Bricks(bricks) => bricks.brick_at(place).copied().unwrap_or_default(),
        }
    }

    fn absorb(&mut self, other: &Self) {
        match (self, other) {
            (Self::Words(words), Self::Words(others)) => words.absorb(others),
            (mine, other) => {
                for brick in places(other.present()) {
                    for place in places(other.brick(brick)) {
                        mine.mark((brick * BRICK_VOXELS + place) as u32);
                    }
                }
            }
        }
    }
}

fn bytes_of(bricks: &SparsePage<BrickMask>) -> usize {
    size_of::<SparsePage<BrickMask>>() + bricks.bricks_bytes()
}

/// Mask of the bricks that exist.
fn present_in(bricks: &SparsePage<BrickMask>) -> BrickMask {
    let mut present = [0; 8];
    bricks.places().for_each(|(place, _)| crate::space::add_to_mask(&mut present, place as usize));
    present
}

/// Morton position of a voxel in its page.
#[inline]
fn place_of([x, y, z]: Local) -> u32 {
    part_of_place(0, x) | part_of_place(1, y) | part_of_place(2, z)
}

// Not inlined, because it is used only if memory is short, and every instruction of the inner loop counts.
#[cold]
#[inline(never)]
fn mark_small(bricks: &mut SparsePage<BrickMask>, place: u32) {
    mark(bricks, place);
}

#[cold]
#[inline(never)]
fn pass_small<const A: usize, const B: usize, const C: usize>(
    bricks: &mut SparsePage<BrickMask>,
    stretch: &Stretch,
    a: u32,
) -> u32 {
    stretch.pass::<A, B, C, _>(bricks, a)
}

#[inline]
fn mark(bricks: &mut SparsePage<BrickMask>, place: u32) {
    bricks.brick(place)[place as usize % BRICK_VOXELS / 64] |= 1 << (place % 64);
}

impl MarkedPage {
    /// Records a ray that ends in a voxel.
    pub(crate) fn hit(&mut self, voxel: VoxelIndex) {
        mark(self.hits.get_or_insert_default(), place_of(voxel.map(|k| k as u32)));
    }

    /// Returns whether all voxels of the page from `low` to `high` are passed or hit; may return `false` if this is
    /// expensive to determine.
    #[inline]
    pub(crate) fn are_marked(&self, low: Local, high: Local) -> bool {
        let Marks::Words(passed) = &self.passed else { return false };
        let [x0, y0, z0] = low.map(|k| k & 63);
        let [x1, y1, z1] = high.map(|k| k & 63);
        for x in x0..=x1 {
            for y in y0..=y1 {
                let column = part_of_place(0, x) | part_of_place(1, y);
                // A word contains up to four voxels along z.
                let mut z = z0;
                while z <= z1 {
                    let last = z1.min(z | 3);
                    let run = FROM[z as usize % 4] & !FROM[last as usize % 4 + 1];
                    let place = column | part_of_place(2, z & !3);
                    let left = run << (place % 64) & !passed.0[place as usize / 64 % WORDS];
                    if left != 0 && left & !self.hits_of_word(place as usize / 64) != 0 {
                        return false;
                    }
                    z = last + 1;
                }
            }
        }
        true
    }

    fn hits_of_word(&self, word: usize) -> u64 {
        self.hits.as_ref().and_then(|hits| hits.brick_at(word / 8)).map_or(0, |brick| brick[word % 8])
    }

    pub(crate) fn absorb(&mut self, other: &Self) {
        self.passed.absorb(&other.passed);
        let Some(others) = &other.hits else { return };
        let hits = self.hits.get_or_insert_default();
        for (place, number) in others.places() {
            let brick = hits.brick(place * BRICK_VOXELS as u32);
            brick.iter_mut().zip(&others.bricks()[number]).for_each(|(word, other)| *word |= other);
        }
    }

    pub(crate) fn count_bricks(&self) -> usize {
        self.present().iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Determines the bricks with marks for [`MarkedPage::found`]. No mark may be added afterwards.
    pub(crate) fn find_bricks(&mut self) {
        self.found = Some(self.present());
    }

    /// Mask of the bricks that have marks, as determined by [`MarkedPage::find_bricks`].
    pub(crate) fn found(&self) -> BrickMask {
        self.found.unwrap_or_else(|| self.present())
    }

    fn present(&self) -> BrickMask {
        let passed = self.passed.present();
        let hits = self.hit_bricks();
        std::array::from_fn(|word| passed[word] | hits[word])
    }

    /// Mask of the bricks that have hits.
    pub(crate) fn hit_bricks(&self) -> BrickMask {
        self.hits.as_deref().map_or([0; 8], present_in)
    }

    /// Masks of a brick: voxels in which rays end, and voxels that rays pass, including those that are also hit.
    #[inline]
    pub(crate) fn brick(&self, place: usize) -> (BrickMask, BrickMask) {
        (self.hits_at(place), self.passed.brick(place))
    }

    /// Hits of the brick at a position.
    #[inline]
    pub(crate) fn hits_at(&self, place: usize) -> BrickMask {
        self.hits.as_ref().and_then(|hits| hits.brick_at(place)).copied().unwrap_or_default()
    }

    /// Voxels of the brick at a position that are passed and not hit.
    #[inline]
    pub(crate) fn misses_at(&self, place: usize) -> BrickMask {
        let mut misses = self.passed.brick(place);
        if let Some(hits) = self.hits.as_ref().and_then(|hits| hits.brick_at(place)) {
            (0..8).for_each(|word| misses[word] &= !hits[word]);
        }
        misses
    }

    /// The bricks with marks. `page` is the index of the page: the indices of its voxels divided by 64.
    pub(crate) fn bricks(&self, page: VoxelIndex) -> impl Iterator<Item = MarkedBrick> {
        places(self.found()).map(move |place| {
            let (hits, passed) = self.brick(place);
            MarkedBrick { index: brick_in_page(page, place as u32), hits, passed }
        })
    }
}

impl Footprint for MarkedPage {
    /// Part of the voxel's Morton position that is determined by its indices along `B` and `C`.
    type Cell = u32;

    fn heap_bytes(&self) -> usize {
        self.passed.heap_bytes() + self.hits.as_deref().map_or(0, bytes_of)
    }

    fn sparse() -> Self {
        Self { passed: Marks::Bricks(Box::default()), hits: None, found: None }
    }

    /// Fast pages are kept. Only their marked bricks are cleared, because most pages have few.
    fn cleared(mut self) -> Option<Self> {
        let Marks::Words(words) = &mut self.passed else { return None };
        match self.found.take() {
            Some(found) => places(found).for_each(|place| words.bricks_mut()[place] = [0; 8]),
            None => words.0.fill(0),
        }
        debug_assert!(words.0.iter().all(|word| *word == 0), "marks were added after the bricks were found");
        self.hits = None;
        Some(self)
    }

    #[inline]
    fn cell<const B: usize, const C: usize>(b: u32, c: u32) -> u32 {
        part_of_place(B, b) | part_of_place(C, c)
    }

    #[inline]
    fn pass<const A: usize>(&mut self, slab: u32, cell: u32) {
        self.passed.mark(part_of_place(A, slab) | cell);
    }

    #[inline]
    fn pass_through<const A: usize>(&mut self, slab: u32, entry: u32, exit: u32) {
        self.pass::<A>(slab, entry);
        self.pass::<A>(slab, exit);
    }

    // The form of the marks is matched once per stretch, not once per voxel.
    #[inline]
    fn pass_stretch<const A: usize, const B: usize, const C: usize>(
        &mut self,
        stretch: &Stretch,
        a: u32,
    ) -> u32 {
        match &mut self.passed {
            Marks::Words(words) => stretch.mark::<A, B, C>(&mut words.0, a),
            Marks::Bricks(bricks) => pass_small::<A, B, C>(bricks, stretch, a),
        }
    }
}

impl Footprint for SparsePage<BrickMask> {
    /// Part of the voxel's Morton position that is determined by its indices along `B` and `C`.
    type Cell = u32;

    fn heap_bytes(&self) -> usize {
        self.bricks_bytes()
    }

    #[inline]
    fn cell<const B: usize, const C: usize>(b: u32, c: u32) -> u32 {
        part_of_place(B, b) | part_of_place(C, c)
    }

    #[inline]
    fn pass<const A: usize>(&mut self, slab: u32, cell: u32) {
        mark(self, part_of_place(A, slab) | cell);
    }

    #[inline]
    fn pass_through<const A: usize>(&mut self, slab: u32, entry: u32, exit: u32) {
        self.pass::<A>(slab, entry);
        self.pass::<A>(slab, exit);
    }
}
