use super::footprint::Footprint;
use super::sparse_page::{BrickContent, SparsePage, part_of_place};
use super::window::{Local, PAGE_EDGE};
use crate::scan::ray::Stretch;
use crate::space::{BRICK_VOXELS, BrickMask, VoxelIndex};

/// The voxels of a page that the rays of a scan pass or end in.
#[derive(Clone, Debug, Default)]
pub(crate) struct MarkedPage {
    passed: Marks,
    /// Few pages have hits: those beside ground and walls.
    hits: Option<Marks>,
}

/// Marked voxels of a page.
#[derive(Clone, Debug)]
enum Marks {
    /// Fast.
    Columns(Columns),
    /// Small, for when memory is short.
    Bricks(Box<SparsePage<BrickMask>>),
}

/// The marks of one brick.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MarkedBrick {
    /// The voxels' indices divided by 8.
    pub(crate) index: VoxelIndex,
    /// Voxels in which rays end.
    pub(crate) hits: BrickMask,
    /// Passed voxels, whether hit or not.
    pub(crate) passed: BrickMask,
}

/// One word per column of 64 voxels along z, columns in the order of x and then y. Marking a voxel is one operation on
/// one word, found without a table.
#[derive(Clone, Debug)]
struct Columns(Box<[u64; COLUMNS]>);

const COLUMNS: usize = (PAGE_EDGE * PAGE_EDGE) as usize;

impl Default for Columns {
    fn default() -> Self {
        Self(vec![0; COLUMNS].try_into().expect("as many columns"))
    }
}

impl Columns {
    #[inline]
    fn mark(&mut self, x: u32, y: u32, z: u32) {
        self.0[((x & 63) << 6 | y & 63) as usize] |= 1 << (z & 63);
    }

    fn absorb(&mut self, other: &Self) {
        self.0.iter_mut().zip(other.0.iter()).for_each(|(column, other)| *column |= other);
    }

    /// The union of the columns through the bricks at `(x, y)`, in bricks: byte `k` is not 0 if brick `k` has marks.
    fn union(&self, x: usize, y: usize) -> u64 {
        let row = |x: usize| self.0[64 * x + 8 * y..][..8].iter().fold(0, |union, column| union | column);
        (8 * x..8 * x + 8).fold(0, |union, x| union | row(x))
    }

    /// The mask of one brick in Morton order.
    fn brick(&self, x: usize, y: usize, z: usize) -> BrickMask {
        /// For each value of four bits of a column, where these bits are in a word of a mask.
        const SPREAD: [u64; 16] = spread();
        let mut mask = [0; 8];
        for dx in 0..8 {
            for dy in 0..8 {
                let bits = (self.0[64 * (8 * x + dx) + 8 * y + dy] >> (8 * z)) as usize & 0xff;
                let word = dx >> 2 | (dy >> 2) << 1;
                let shift = (dx & 1) | (dy & 1) << 1 | (dx >> 1 & 1) << 3 | (dy >> 1 & 1) << 4;
                mask[word] |= SPREAD[bits & 15] << shift;
                mask[word | 4] |= SPREAD[bits >> 4] << shift;
            }
        }
        mask
    }
}

const fn spread() -> [u64; 16] {
    let mut spread = [0; 16];
    let mut bits = 0;
    while bits < 16 {
        let [b0, b1, b2, b3] = [bits & 1, bits >> 1 & 1, bits >> 2 & 1, bits >> 3 & 1];
        // Bit 2 of a place is bit 0 of z, bit 5 is bit 1.
        spread[bits] = b0 as u64 | (b1 as u64) << 4 | (b2 as u64) << 32 | (b3 as u64) << 36;
        bits += 1;
    }
    spread
}

impl BrickContent for BrickMask {
    const EMPTY: Self = [0; 8];
}

impl Default for Marks {
    fn default() -> Self {
        Self::Columns(Columns::default())
    }
}

impl Marks {
    fn sparse() -> Self {
        Self::Bricks(Box::default())
    }

    fn empty_like(&self) -> Self {
        match self {
            Self::Columns(_) => Self::default(),
            Self::Bricks(_) => Self::sparse(),
        }
    }

    fn heap_bytes(&self) -> usize {
        match self {
            Self::Columns(_) => size_of::<[u64; COLUMNS]>(),
            Self::Bricks(bricks) => size_of::<SparsePage<BrickMask>>() + bricks.bricks_bytes(),
        }
    }

    #[inline]
    fn mark(&mut self, x: u32, y: u32, z: u32) {
        match self {
            Self::Columns(columns) => columns.mark(x, y, z),
            Self::Bricks(bricks) => mark_small(bricks, [x, y, z]),
        }
    }

    /// Which bricks at `(x, y)`, in bricks, have marks: byte `k` is not 0 if brick `k` has.
    fn union(&self, x: usize, y: usize) -> u64 {
        match self {
            Self::Columns(columns) => columns.union(x, y),
            Self::Bricks(bricks) => {
                let is_in = |z: &usize| bricks.brick_at(place_of_brick(x, y, *z)).is_some();
                (0..8).filter(is_in).fold(0, |union, z| union | 1 << (8 * z))
            }
        }
    }

    /// The mask of one brick in Morton order.
    fn brick(&self, x: usize, y: usize, z: usize) -> BrickMask {
        match self {
            Self::Columns(columns) => columns.brick(x, y, z),
            Self::Bricks(bricks) => bricks.brick_at(place_of_brick(x, y, z)).copied().unwrap_or_default(),
        }
    }

    fn absorb(&mut self, other: &Self) {
        match (self, other) {
            (Self::Columns(columns), Self::Columns(others)) => columns.absorb(others),
            (mine, other) => {
                let bricks = (0..8).flat_map(|x| (0..8).flat_map(move |y| (0..8).map(move |z| [x, y, z])));
                for [x, y, z] in bricks {
                    let mask = other.brick(x, y, z);
                    for place in crate::space::places(mask) {
                        let local = local_of(place);
                        let at = |k: usize, brick: usize| 8 * brick as u32 + local[k];
                        mine.mark(at(0, x), at(1, y), at(2, z));
                    }
                }
            }
        }
    }
}

/// The voxel at a place of a brick, relative to the brick's lowest.
fn local_of(place: usize) -> Local {
    std::array::from_fn(|axis| {
        (0..3).fold(0, |index, bit| index | (place as u32 >> (3 * bit + axis as u32) & 1) << bit)
    })
}

/// The place of a brick in its page's Morton order.
fn place_of_brick(x: usize, y: usize, z: usize) -> usize {
    let [x, y, z] = [x, y, z].map(|k| 8 * k as u32);
    (part_of_place(0, x) | part_of_place(1, y) | part_of_place(2, z)) as usize / BRICK_VOXELS
}

// Outlined: it is used only when memory is short, and every instruction of the inner loop counts.
#[cold]
#[inline(never)]
fn mark_small(bricks: &mut SparsePage<BrickMask>, [x, y, z]: Local) {
    mark(bricks, part_of_place(0, x) | part_of_place(1, y) | part_of_place(2, z));
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
    /// A ray ends in a voxel.
    pub(crate) fn hit(&mut self, [x, y, z]: VoxelIndex) {
        let hits = self.hits.get_or_insert_with(|| self.passed.empty_like());
        hits.mark(x as u32, y as u32, z as u32);
    }

    /// Whether all voxels of the page from `low` to `high` are passed or hit; may be false where this is costly to
    /// tell.
    #[inline]
    pub(crate) fn are_marked(&self, low: Local, high: Local) -> bool {
        let Marks::Columns(passed) = &self.passed else { return false };
        let hits = self.hits.as_ref().and_then(|hits| match hits {
            Marks::Columns(hits) => Some(hits),
            Marks::Bricks(_) => None,
        });
        let [x0, y0, z0] = low.map(|k| k & 63);
        let [x1, y1, z1] = high.map(|k| k & 63);
        let wanted = u64::MAX >> (63 - z1) & u64::MAX << z0;
        for column in (x0 << 6..=x1 << 6).step_by(64) {
            for column in (column | y0) as usize..=(column | y1) as usize {
                let left = wanted & !passed.0[column];
                if left != 0 && hits.is_none_or(|hits| left & !hits.0[column] != 0) {
                    return false;
                }
            }
        }
        true
    }

    /// Adds the marks of another page.
    pub(crate) fn absorb(&mut self, other: &Self) {
        self.passed.absorb(&other.passed);
        if let Some(hits) = &other.hits {
            self.hits.get_or_insert_with(|| self.passed.empty_like()).absorb(hits);
        }
    }

    /// Number of bricks with marks.
    pub(crate) fn count_bricks(&self) -> usize {
        let in_column = |(x, y)| {
            let marks = self.passed.union(x, y) | self.hits.as_ref().map_or(0, |hits| hits.union(x, y));
            (0..8).filter(|z| marks >> (8 * z) & 0xff != 0).count()
        };
        (0..8).flat_map(|x| (0..8).map(move |y| (x, y))).map(in_column).sum()
    }

    /// The bricks with marks; `page` is the page's index: its voxels' indices divided by 64.
    pub(crate) fn bricks(&self, page: VoxelIndex) -> Vec<MarkedBrick> {
        let mut bricks = Vec::new();
        for (x, y) in (0..8).flat_map(|x| (0..8).map(move |y| (x, y))) {
            let passed = self.passed.union(x, y);
            let hit = self.hits.as_ref().map_or(0, |hits| hits.union(x, y));
            let is_in = |bits: u64, z: usize| bits >> (8 * z) & 0xff != 0;
            for z in (0..8).filter(|&z| is_in(passed | hit, z)) {
                let local = [x as i32, y as i32, z as i32];
                let hits = self.hits.as_ref().filter(|_| is_in(hit, z));
                bricks.push(MarkedBrick {
                    index: std::array::from_fn(|k| page[k] * 8 + local[k]),
                    hits: hits.map_or([0; 8], |hits| hits.brick(x, y, z)),
                    passed: self.passed.brick(x, y, z),
                });
            }
        }
        bricks
    }
}

impl Footprint for MarkedPage {
    /// The indices along the slab.
    type Cell = (u32, u32);

    fn heap_bytes(&self) -> usize {
        self.passed.heap_bytes() + self.hits.as_ref().map_or(0, Marks::heap_bytes)
    }

    fn sparse() -> Self {
        Self { passed: Marks::sparse(), hits: None }
    }

    #[inline]
    fn cell<const B: usize, const C: usize>(b: u32, c: u32) -> (u32, u32) {
        (b, c)
    }

    #[inline]
    fn pass<const A: usize>(&mut self, slab: u32, (b, c): (u32, u32)) {
        match A {
            0 => self.passed.mark(slab, b, c),
            1 => self.passed.mark(b, slab, c),
            _ => self.passed.mark(b, c, slab),
        }
    }

    #[inline]
    fn pass_through<const A: usize>(&mut self, slab: u32, entry: (u32, u32), exit: (u32, u32)) {
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
            Marks::Columns(columns) => stretch.pass::<A, B, C, _>(columns, a),
            Marks::Bricks(bricks) => pass_small::<A, B, C>(bricks, stretch, a),
        }
    }
}

impl Footprint for Columns {
    type Cell = (u32, u32);

    fn heap_bytes(&self) -> usize {
        size_of::<[u64; COLUMNS]>()
    }

    #[inline]
    fn cell<const B: usize, const C: usize>(b: u32, c: u32) -> (u32, u32) {
        (b, c)
    }

    #[inline]
    fn pass<const A: usize>(&mut self, slab: u32, (b, c): (u32, u32)) {
        match A {
            0 => self.mark(slab, b, c),
            1 => self.mark(b, slab, c),
            _ => self.mark(b, c, slab),
        }
    }

    #[inline]
    fn pass_through<const A: usize>(&mut self, slab: u32, entry: (u32, u32), exit: (u32, u32)) {
        self.pass::<A>(slab, entry);
        self.pass::<A>(slab, exit);
    }
}

impl Footprint for SparsePage<BrickMask> {
    /// The part of the voxel's place that comes from its indices along the slab.
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
