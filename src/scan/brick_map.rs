use super::window::{Local, Window};
use crate::space::{BRICK_EDGE, VoxelIndex};
use rustc_hash::FxHashMap;

/// Bricks in which the rays of a scan leave something.
///
/// Inside the window around the sensor, where nearly all are, a brick is found by two look-ups in tables; outside, in a
/// hash map.
#[derive(Clone, Debug, Default)]
pub(super) struct BrickMap<B> {
    window: Window,
    /// Page number, plus one, of each page of the window; 0 for a page without bricks.
    directory: Vec<u32>,
    /// Slot, plus one, of each brick of a page; 0 for none.
    pages: Vec<[u32; 512]>,
    /// Slot of each brick outside the window.
    far: FxHashMap<VoxelIndex, u32>,
    bricks: Vec<B>,
    /// Index of each brick: its voxels' indices over 8.
    indices: Vec<VoxelIndex>,
}

impl<B: Default> BrickMap<B> {
    /// Forgets all bricks, and begins anew with another window; the memory is kept.
    pub(super) fn clear(&mut self, window: Window) {
        self.window = window;
        self.directory.clear();
        self.directory.resize(window.pages().map(|pages| pages as usize).iter().product(), 0);
        self.pages.clear();
        self.far.clear();
        self.bricks.clear();
        self.indices.clear();
    }

    /// Bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        self.directory.capacity() * size_of::<u32>()
            + self.pages.capacity() * size_of::<[u32; 512]>()
            + self.far.capacity() * 8 / 7 * (size_of::<(VoxelIndex, u32)>() + 1)
            + self.bricks.capacity() * size_of::<B>()
            + self.indices.capacity() * size_of::<VoxelIndex>()
    }

    pub(super) fn window(&self) -> &Window {
        &self.window
    }

    /// The brick that holds a voxel of the window.
    #[inline]
    pub(super) fn at(&mut self, voxel: Local) -> &mut B {
        let slot = match self.slot(voxel) {
            Some(slot) => slot,
            None => self.new_near(voxel),
        };
        &mut self.bricks[slot]
    }

    /// The number of the brick that holds a voxel, wherever it is.
    pub(super) fn slot_of(&mut self, voxel: VoxelIndex) -> usize {
        if let Some(local) = self.window.local(voxel) {
            return self.slot(local).unwrap_or_else(|| self.new_near(local));
        }
        let index = voxel.map(|k| k.div_euclid(BRICK_EDGE));
        if let Some(&slot) = self.far.get(&index) {
            return slot as usize;
        }
        let slot = self.push(index);
        self.far.insert(index, slot as u32);
        slot
    }

    /// The bricks, by number.
    pub(super) fn bricks(&self) -> &[B] {
        &self.bricks
    }

    /// The bricks, by number, to change.
    pub(super) fn bricks_mut(&mut self) -> &mut [B] {
        &mut self.bricks
    }

    /// Index of each brick, by number: its voxels' indices over 8.
    pub(super) fn indices(&self) -> &[VoxelIndex] {
        &self.indices
    }

    #[inline]
    fn slot(&self, voxel: Local) -> Option<usize> {
        let page = self.directory[self.window.page_of(voxel)] as usize;
        let slot = self.pages.get(page.wrapping_sub(1))?[brick_in_page(voxel)] as usize;
        slot.checked_sub(1)
    }

    #[cold]
    fn new_near(&mut self, voxel: Local) -> usize {
        let base = self.window.base();
        let slot = self.push(std::array::from_fn(|k| (base[k] + voxel[k] as i32).div_euclid(BRICK_EDGE)));
        let page = &mut self.directory[self.window.page_of(voxel)];
        if *page == 0 {
            self.pages.push([0; 512]);
            *page = self.pages.len() as u32;
        }
        self.pages[*page as usize - 1][brick_in_page(voxel)] = self.bricks.len() as u32;
        slot
    }

    fn push(&mut self, index: VoxelIndex) -> usize {
        self.bricks.push(B::default());
        self.indices.push(index);
        self.bricks.len() - 1
    }
}

/// Which of its page's bricks holds a voxel.
#[inline]
fn brick_in_page([x, y, z]: Local) -> usize {
    (x / 8 % 8 * 64 + y / 8 % 8 * 8 + z / 8 % 8) as usize
}
