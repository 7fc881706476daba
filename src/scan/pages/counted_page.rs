use super::footprint::Footprint;
use super::sparse_page::{BrickContent, SparsePage, part_of_place};
use crate::space::BRICK_VOXELS;
use rustc_hash::FxHashMap;

/// Page with a counter per voxel: the number of rays that passed it since its last hit.
///
/// Counts rarely reach 256, so the lower bytes of a brick's counts are stored together, and the upper bytes separately.
/// Bricks of bytes take half as long to write, clear and read as bricks of 16-bit counts.
#[derive(Clone, Debug, Default)]
pub(crate) struct CountedPage {
    low: SparsePage<Bytes>,
    /// Upper bytes of the counts, by index of the brick. A brick is absent while all of its upper bytes are 0.
    high: FxHashMap<usize, Box<Bytes>>,
}

/// One byte of each voxel's count, in Morton order.
type Bytes = [u8; BRICK_VOXELS];

#[derive(Clone, Copy, Debug)]
pub(crate) struct BrickCounts<'a> {
    low: &'a Bytes,
    high: Option<&'a Bytes>,
}

/// Maximum number of rays that a page can count. A ray passes a voxel at most once.
pub(crate) const MAX_RAYS: usize = u16::MAX as usize;

impl BrickContent for Bytes {
    const EMPTY: Self = [0; BRICK_VOXELS];
}

impl BrickCounts<'_> {
    /// The count of a voxel, by its Morton position.
    #[inline]
    pub(crate) fn get(&self, place: usize) -> u16 {
        u16::from_le_bytes([self.low[place], self.high.map_or(0, |high| high[place])])
    }

    /// The counts as bytes, if all are below 256.
    #[inline]
    pub(crate) fn as_bytes(&self) -> Option<&Bytes> {
        if self.high.is_none() { Some(self.low) } else { None }
    }
}

impl CountedPage {
    /// Counts a ray that passes the voxel at a Morton position.
    #[inline]
    pub(crate) fn pass_at(&mut self, place: u32) {
        self.add(place, 1);
    }

    /// Adds 0 or 1 to the count of a voxel.
    #[inline]
    fn add(&mut self, place: u32, rays: u8) {
        let low = &mut self.low.brick(place)[place_in_brick(place)];
        let (sum, is_full) = low.overflowing_add(rays);
        *low = sum;
        if is_full {
            self.carry(place);
        }
    }

    #[cold]
    #[inline(never)]
    fn carry(&mut self, place: u32) {
        let high = self.high.entry(self.low.number_of(place)).or_insert_with(|| Box::new(Bytes::EMPTY));
        high[place_in_brick(place)] += 1;
    }

    /// Resets the count of a voxel to 0 and returns the previous one; creates its brick if it is absent.
    pub(crate) fn take(&mut self, place: u32) -> u16 {
        let low = std::mem::take(&mut self.low.brick(place)[place_in_brick(place)]);
        let high = match self.high.is_empty() {
            true => None,
            false => self.high.get_mut(&self.low.number_of(place)),
        };
        u16::from_le_bytes([low, high.map_or(0, |high| std::mem::take(&mut high[place_in_brick(place)]))])
    }

    pub(crate) fn brick_count(&self) -> usize {
        self.low.bricks().len()
    }

    /// The bricks in the order of their creation.
    pub(crate) fn bricks(&self) -> impl Iterator<Item = BrickCounts<'_>> {
        let counts = |(number, low)| BrickCounts { low, high: self.high.get(&number).map(|high| &**high) };
        self.low.bricks().iter().enumerate().map(counts)
    }

    /// The Morton positions of the bricks in the page, in order, with the indices of the bricks.
    pub(crate) fn places(&self) -> impl Iterator<Item = (u32, usize)> {
        self.low.places()
    }

    /// The index of the existing brick that contains a voxel.
    pub(crate) fn number_of(&self, place: u32) -> usize {
        self.low.number_of(place)
    }
}

#[inline]
fn place_in_brick(place: u32) -> usize {
    place as usize % BRICK_VOXELS
}

impl Footprint for CountedPage {
    /// Part of the voxel's Morton position that is determined by its indices along `B` and `C`.
    type Cell = u32;

    fn heap_bytes(&self) -> usize {
        let high = self.high.len() * (size_of::<Bytes>() + size_of::<(usize, Box<Bytes>)>());
        self.low.bricks_bytes() + high
    }

    fn cleared(self) -> Option<Self> {
        // The upper bytes are dropped: most of them are close to the sensor, which moves on.
        Some(Self { low: self.low.emptied(), high: FxHashMap::default() })
    }

    #[inline]
    fn cell<const B: usize, const C: usize>(b: u32, c: u32) -> u32 {
        part_of_place(B, b) | part_of_place(C, c)
    }

    #[inline]
    fn pass<const A: usize>(&mut self, slab: u32, cell: u32) {
        self.pass_at(part_of_place(A, slab) | cell);
    }

    #[inline]
    fn pass_through<const A: usize>(&mut self, slab: u32, entry: u32, exit: u32) {
        let slab = part_of_place(A, slab);
        self.add(slab | entry, 1);
        self.add(slab | exit, u8::from(entry != exit));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_exceed_a_byte_and_are_taken_completely() {
        let mut page = CountedPage::default();
        // Two voxels of one brick, one of another.
        for (place, rays) in [(3, 70), (7, 300), (512 * 9 + 7, MAX_RAYS)] {
            (0..rays).for_each(|_| page.pass_at(place));
        }
        let counts = |page: &CountedPage| -> Vec<_> {
            page.bricks()
                .map(|brick| ([3, 7].map(|place| brick.get(place)), brick.as_bytes().is_some()))
                .collect()
        };
        assert_eq!(counts(&page), [([70, 300], false), ([0, u16::MAX], false)]);
        assert_eq!([7, 512 * 9 + 7, 3].map(|place| page.take(place)), [300, u16::MAX, 70]);
        assert_eq!(counts(&page), [([0; 2], false); 2]);
        page.pass_at(3);
        let page = page.cleared().unwrap();
        assert_eq!((page.brick_count(), page.bricks().count()), (0, 0));
        let mut page = page;
        page.pass_at(7);
        assert_eq!(counts(&page), [([0, 1], true)]);
    }
}
