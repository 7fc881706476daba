use super::footprint::Footprint;
use super::window::{Local, PAGE_EDGE};
use crate::space::{BrickMask, VoxelIndex};

/// Which voxels of a page the rays of a scan pass or end in.
///
/// A word for every column of 64 voxels along z, columns in the order of x and then y: a voxel is marked by one
/// operation on one word, found without a table.
#[derive(Clone, Debug, Default)]
pub(super) struct MarkedPage {
    passed: Columns,
    /// Of few pages, beside a ground or a wall.
    hits: Option<Columns>,
}

/// The marks of one brick.
#[derive(Clone, Copy, Debug)]
pub(super) struct MarkedBrick {
    /// The brick's voxels' indices over 8.
    pub(super) index: VoxelIndex,
    /// Voxels in which rays end.
    pub(super) hits: BrickMask,
    /// Passed voxels, whether hit or not.
    pub(super) passed: BrickMask,
}

const COLUMNS: usize = (PAGE_EDGE * PAGE_EDGE) as usize;

#[derive(Clone, Debug)]
struct Columns(Box<[u64; COLUMNS]>);

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

    /// The bits of the columns through the bricks at `(x, y)`, in bricks: byte `k` is not 0 if brick `k` has marks.
    fn union(&self, x: usize, y: usize) -> u64 {
        let row = |x: usize| self.0[64 * x + 8 * y..][..8].iter().fold(0, |union, column| union | column);
        (8 * x..8 * x + 8).fold(0, |union, x| union | row(x))
    }

    /// The mask of one brick in Morton order.
    fn brick(&self, x: usize, y: usize, z: usize) -> BrickMask {
        /// Where a column's bits are in a word of a mask: four of them, by their value.
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

impl MarkedPage {
    /// A ray ends in a voxel.
    pub(super) fn hit(&mut self, [x, y, z]: VoxelIndex) {
        self.hits.get_or_insert_default().mark(x as u32, y as u32, z as u32);
    }

    /// Whether all voxels of the page from `low` to `high` are passed or hit.
    #[inline]
    pub(super) fn are_marked(&self, low: Local, high: Local) -> bool {
        let [x0, y0, z0] = low.map(|k| k & 63);
        let [x1, y1, z1] = high.map(|k| k & 63);
        let wanted = u64::MAX >> (63 - z1) & u64::MAX << z0;
        for column in (x0 << 6..=x1 << 6).step_by(64) {
            for column in (column | y0) as usize..=(column | y1) as usize {
                let left = wanted & !self.passed.0[column];
                if left != 0 && self.hits.as_ref().is_none_or(|hits| left & !hits.0[column] != 0) {
                    return false;
                }
            }
        }
        true
    }

    /// Adds the marks of another page.
    pub(super) fn absorb(&mut self, other: &Self) {
        self.passed.absorb(&other.passed);
        if let Some(hits) = &other.hits {
            self.hits.get_or_insert_default().absorb(hits);
        }
    }

    /// The bricks with marks; `page` is the page's index, its voxels' indices over 64.
    pub(super) fn bricks(&self, page: VoxelIndex) -> Vec<MarkedBrick> {
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
        (1 + usize::from(self.hits.is_some())) * size_of::<[u64; COLUMNS]>()
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
}
