use super::slab_masks::{Slabs, add_slabs, slab_bit};
use super::window::{Local, Window};
use crate::space::{BRICK_EDGE, BrickMask, VoxelIndex, place_of_voxel};
use rayon::prelude::*;

/// The voxels of a window that a scan's rays pass or end in: each voxel once.
#[derive(Clone, Debug, Default)]
pub(super) struct Marks {
    window: Window,
    /// Page number, plus one, of each page of the window; 0 for a page without bricks.
    directory: Vec<u32>,
    /// Slot, plus one, of each brick of a page; 0 for a brick without marks.
    pages: Vec<[u32; 512]>,
    bricks: Vec<MarkedBrick>,
    /// Index of each brick: its voxels' indices over 8.
    indices: Vec<VoxelIndex>,
}

/// The marks of one brick.
#[derive(Clone, Debug, Default)]
#[repr(align(64))]
struct MarkedBrick {
    /// Passed voxels as slabs along x, along y and along z.
    passed: [Slabs; 3],
    hits: BrickMask,
}

impl Marks {
    /// Forgets all marks, and takes others in another window; the memory is kept.
    pub(super) fn clear(&mut self, window: Window) {
        self.window = window;
        self.directory.clear();
        self.directory.resize(window.pages().map(|pages| pages as usize).iter().product(), 0);
        self.pages.clear();
        self.bricks.clear();
        self.indices.clear();
    }

    /// Bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        self.directory.capacity() * size_of::<u32>()
            + self.pages.capacity() * size_of::<[u32; 512]>()
            + self.bricks.capacity() * size_of::<MarkedBrick>()
            + self.indices.capacity() * size_of::<VoxelIndex>()
    }

    pub(super) fn window(&self) -> &Window {
        &self.window
    }

    /// Slot of the brick that holds a voxel of the window.
    #[inline]
    pub(super) fn slot_of(&mut self, [x, y, z]: Local) -> usize {
        let [_, height, depth] = self.window.pages();
        let page = ((x / 64 * height + y / 64) * depth + z / 64) as usize;
        let brick = (x / 8 % 8 * 64 + y / 8 % 8 * 8 + z / 8 % 8) as usize;
        let page = self.directory[page] as usize;
        if page != 0 {
            let slot = self.pages[page - 1][brick] as usize;
            if slot != 0 {
                return slot - 1;
            }
        }
        self.new_brick([x, y, z])
    }

    #[cold]
    fn new_brick(&mut self, [x, y, z]: Local) -> usize {
        let [_, height, depth] = self.window.pages();
        let page = &mut self.directory[((x / 64 * height + y / 64) * depth + z / 64) as usize];
        if *page == 0 {
            self.pages.push([0; 512]);
            *page = self.pages.len() as u32;
        }
        let local = [x, y, z];
        let base = self.window.base();
        let index = std::array::from_fn(|k| base[k].wrapping_add(local[k] as i32).div_euclid(BRICK_EDGE));
        self.bricks.push(MarkedBrick::default());
        self.indices.push(index);
        let brick = (x / 8 % 8 * 64 + y / 8 % 8 * 8 + z / 8 % 8) as usize;
        self.pages[*page as usize - 1][brick] = self.bricks.len() as u32;
        self.bricks.len() - 1
    }

    /// The slabs of a brick along an axis.
    #[inline]
    pub(super) fn slabs(&mut self, slot: usize, axis: usize) -> &mut Slabs {
        &mut self.bricks[slot].passed[axis]
    }

    /// Marks a voxel as passed.
    pub(super) fn pass(&mut self, voxel: Local) {
        let slot = self.slot_of(voxel);
        let [x, y, z] = voxel;
        self.bricks[slot].passed[0][(x & 7) as usize] |= slab_bit(y, z);
    }

    /// Marks a voxel as hit.
    pub(super) fn hit(&mut self, voxel: Local) {
        let slot = self.slot_of(voxel);
        let place = place_of_voxel(voxel.map(|k| k as i32));
        self.bricks[slot].hits[place / 64] |= 1 << (place % 64);
    }

    /// Adds the marks of another with the same window.
    pub(super) fn absorb(&mut self, other: &Self) {
        let base = self.window.base();
        for (brick, index) in other.bricks.iter().zip(&other.indices) {
            let local = std::array::from_fn(|k| (index[k] * BRICK_EDGE).wrapping_sub(base[k]) as u32);
            let slot = self.slot_of(local);
            let mine = &mut self.bricks[slot];
            let words = mine.passed.iter_mut().chain([&mut mine.hits]).flatten();
            words
                .zip(brick.passed.iter().chain([&brick.hits]).flatten())
                .for_each(|(word, other)| *word |= other);
        }
    }

    /// Index of each brick with marks, by slot: its voxels' indices over 8.
    pub(super) fn bricks(&self) -> &[VoxelIndex] {
        &self.indices
    }

    /// Ends the marking: puts what was passed into masks in Morton order.
    pub(super) fn finish(&mut self) {
        self.bricks.par_iter_mut().with_min_len(1024).for_each(MarkedBrick::finish);
    }

    /// Voxels of a brick that were hit, and voxels that were passed, whether hit or not; after [`Marks::finish`].
    pub(super) fn masks(&self, slot: usize) -> (BrickMask, BrickMask) {
        let brick = &self.bricks[slot];
        (brick.hits, brick.passed[0])
    }
}

impl MarkedBrick {
    fn finish(&mut self) {
        let mut passed = [0; 8];
        add_slabs::<0>(&self.passed[0], &mut passed);
        add_slabs::<1>(&self.passed[1], &mut passed);
        add_slabs::<2>(&self.passed[2], &mut passed);
        self.passed[0] = passed;
    }
}
