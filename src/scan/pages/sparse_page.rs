use super::window::PAGE_EDGE;
use crate::space::{BRICK_EDGE, BRICK_VOXELS, MortonCode, VoxelIndex, VoxelKey, place_of_voxel};

/// Page in which only bricks that rays write to take memory.
///
/// A voxel is found by its Morton position in the page, so a ray crosses from brick to brick without border tests.
#[derive(Clone, Debug)]
pub(crate) struct SparsePage<B> {
    /// Number of each brick, in Morton order, from 1; 0 if it is absent.
    numbers: [u16; PAGE_BRICKS],
    bricks: Vec<B>,
}

pub(crate) trait BrickContent: Copy {
    /// Content of a brick that no ray has written to.
    const EMPTY: Self;
}

pub(crate) const PAGE_BRICKS: usize = 512;

/// The part of a voxel's Morton position that its index along an axis determines. The upper nine of the 18 bits are the
/// position of the brick in the page.
#[inline]
pub(crate) fn part_of_place(axis: usize, index: u32) -> u32 {
    PARTS[axis][index as usize % PAGE_EDGE as usize]
}

/// Values of [`part_of_place`], by axis and index. A table per axis makes it one look-up without a shift.
static PARTS: [[u32; PAGE_EDGE as usize]; 3] = parts();

const fn parts() -> [[u32; PAGE_EDGE as usize]; 3] {
    let mut parts = [[0; PAGE_EDGE as usize]; 3];
    let mut index = 0;
    while index < PAGE_EDGE as usize {
        let low = place_of_voxel([index as i32, 0, 0]) as u32;
        let high = place_of_voxel([index as i32 / BRICK_EDGE, 0, 0]) as u32;
        let part = high << 9 | low;
        (parts[0][index], parts[1][index], parts[2][index]) = (part, part << 1, part << 2);
        index += 1;
    }
    parts
}

/// Morton position of a voxel in its page.
#[inline]
pub(crate) fn place_in_page(voxel: VoxelIndex) -> u32 {
    (0..3).fold(0, |place, axis| place | part_of_place(axis, voxel[axis] as u32))
}

/// Returns the index of the brick at a position of a page: the indices of its voxels divided by 8. `page` is the index
/// of the page: the indices of its voxels divided by 64.
pub(crate) fn brick_in_page(page: VoxelIndex, place: u32) -> VoxelIndex {
    let VoxelKey(local) = MortonCode(place.into()).to_key();
    std::array::from_fn(|k| page[k] * 8 + i32::from(local[k]))
}

impl<B> Default for SparsePage<B> {
    fn default() -> Self {
        Self { numbers: [0; PAGE_BRICKS], bricks: Vec::new() }
    }
}

impl<B: BrickContent> SparsePage<B> {
    /// Returns the brick that contains a voxel; creates it if it is absent.
    #[inline]
    pub(crate) fn brick(&mut self, place: u32) -> &mut B {
        let brick = place as usize / BRICK_VOXELS % PAGE_BRICKS;
        let mut number = usize::from(self.numbers[brick]);
        if number == 0 {
            number = self.make(brick);
        }
        &mut self.bricks[number - 1]
    }

    /// The bricks in the order of their creation.
    pub(crate) fn bricks(&self) -> &[B] {
        &self.bricks
    }

    /// The brick at a position of the page, if it exists.
    pub(crate) fn brick_at(&self, place: usize) -> Option<&B> {
        self.bricks.get(usize::from(self.numbers[place]).wrapping_sub(1))
    }

    /// The Morton positions of the bricks in the page, in order, with the indices of the bricks.
    pub(crate) fn places(&self) -> impl Iterator<Item = (u32, usize)> {
        let number = |(place, number): (u32, &u16)| Some((place, usize::from(*number).checked_sub(1)?));
        (0..).zip(&self.numbers).filter_map(number)
    }

    /// The index of the existing brick that contains a voxel.
    pub(crate) fn number_of(&self, place: u32) -> usize {
        usize::from(self.numbers[place as usize / BRICK_VOXELS % PAGE_BRICKS]).saturating_sub(1)
    }

    pub(crate) fn bricks_bytes(&self) -> usize {
        self.bricks.capacity() * size_of::<B>()
    }

    /// Removes all bricks and keeps the memory.
    pub(crate) fn emptied(mut self) -> Self {
        self.numbers.fill(0);
        self.bricks.clear();
        self
    }

    #[cold]
    fn make(&mut self, brick: usize) -> usize {
        self.bricks.push(B::EMPTY);
        self.numbers[brick] = self.bricks.len() as u16;
        self.bricks.len()
    }
}
