use super::footprint::Footprint;
use super::window::PAGE_EDGE;
use crate::space::{BRICK_EDGE, BRICK_VOXELS, MortonCode, VoxelIndex, VoxelKey, place_of_voxel};

/// How many rays pass each voxel of a page; since the voxel was last hit.
///
/// Only bricks that rays pass take memory, and a ray goes from brick to brick without looking where one ends.
#[derive(Clone, Debug)]
pub(super) struct CountedPage {
    /// The number of each brick, in Morton order, from 1; 0 for none.
    numbers: [u16; PAGE_BRICKS],
    bricks: Vec<Counts>,
}

/// The count of each voxel of a brick, in Morton order. A ray passes a voxel once at most: the counts of up to 65 535
/// rays fit.
pub(super) type Counts = [u16; BRICK_VOXELS];

/// At most so many rays are counted in a page.
pub(super) const MAX_RAYS: usize = u16::MAX as usize;

const PAGE_BRICKS: usize = 512;

impl Default for CountedPage {
    fn default() -> Self {
        Self { numbers: [0; PAGE_BRICKS], bricks: Vec::new() }
    }
}

/// The part of a voxel's place in Morton order that its index along an axis makes. Of the page's 18 bits the upper nine
/// are the place of the brick.
#[inline]
fn part_of_place(axis: usize, index: u32) -> u32 {
    const SPREAD: [u32; PAGE_EDGE as usize] = spread();
    SPREAD[index as usize % PAGE_EDGE as usize] << axis
}

const fn spread() -> [u32; PAGE_EDGE as usize] {
    let mut spread = [0; PAGE_EDGE as usize];
    let mut index = 0;
    while index < spread.len() {
        let low = place_of_voxel([index as i32, 0, 0]) as u32;
        let high = place_of_voxel([index as i32 / BRICK_EDGE, 0, 0]) as u32;
        spread[index] = high << 9 | low;
        index += 1;
    }
    spread
}

/// The place of a voxel in its page's Morton order.
#[inline]
pub(super) fn place_in_page(voxel: VoxelIndex) -> u32 {
    (0..3).fold(0, |place, axis| place | part_of_place(axis, voxel[axis] as u32))
}

/// The index of the brick at a place of a page: its voxels' indices over 8. `page` is the page's, over 64.
pub(super) fn brick_in_page(page: VoxelIndex, place: u32) -> VoxelIndex {
    let VoxelKey(local) = MortonCode(place.into()).to_key();
    std::array::from_fn(|k| page[k] * 8 + i32::from(local[k]))
}

impl CountedPage {
    /// The count of the voxel at a place.
    #[inline]
    pub(super) fn count(&mut self, place: u32) -> &mut u16 {
        let (brick, voxel) = (place as usize / BRICK_VOXELS % PAGE_BRICKS, place as usize % BRICK_VOXELS);
        let mut number = usize::from(self.numbers[brick]);
        if number == 0 {
            number = self.make(brick);
        }
        &mut self.bricks[number - 1][voxel]
    }

    /// The bricks that are there, by number less one: counts.
    pub(super) fn bricks(&self) -> &[Counts] {
        &self.bricks
    }

    /// The places of the bricks in the page, in Morton order, and the numbers less one.
    pub(super) fn places(&self) -> impl Iterator<Item = (u32, usize)> {
        let number = |(place, number): (u32, &u16)| Some((place, usize::from(*number).checked_sub(1)?));
        (0..).zip(&self.numbers).filter_map(number)
    }

    /// The number less one of the brick that holds the voxel at a place, which was counted.
    pub(super) fn brick_of(&self, place: u32) -> usize {
        usize::from(self.numbers[place as usize / BRICK_VOXELS % PAGE_BRICKS]).saturating_sub(1)
    }

    #[cold]
    fn make(&mut self, brick: usize) -> usize {
        self.bricks.push([0; BRICK_VOXELS]);
        self.numbers[brick] = self.bricks.len() as u16;
        self.bricks.len()
    }
}

impl Footprint for CountedPage {
    /// The part of the voxel's place that its indices along the slab make.
    type Cell = u32;

    fn heap_bytes(&self) -> usize {
        self.bricks.capacity() * size_of::<Counts>()
    }

    fn cleared(mut self) -> Option<Self> {
        self.numbers.fill(0);
        self.bricks.clear();
        Some(self)
    }

    #[inline]
    fn cell<const B: usize, const C: usize>(b: u32, c: u32) -> u32 {
        part_of_place(B, b) | part_of_place(C, c)
    }

    #[inline]
    fn pass<const A: usize>(&mut self, slab: u32, cell: u32) {
        *self.count(part_of_place(A, slab) | cell) += 1;
    }

    #[inline]
    fn pass_through<const A: usize>(&mut self, slab: u32, entry: u32, exit: u32) {
        let slab = part_of_place(A, slab);
        *self.count(slab | entry) += 1;
        *self.count(slab | exit) += u16::from(entry != exit);
    }
}
