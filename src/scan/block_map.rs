use super::footprint::Footprint;
use super::marked_page::MarkedPage;
use super::window::{Local, PAGE_EDGE, Window};
use crate::space::VoxelIndex;
use rustc_hash::FxHashMap;

/// Blocks of voxels in which the rays of a scan leave something.
///
/// Inside the window around the sensor, where nearly all are, a block is found by a look-up in a table for pages, by
/// two for bricks; outside, in a hash map.
#[derive(Clone, Debug, Default)]
pub(super) struct BlockMap<B> {
    window: Window,
    /// Number, plus one, of each page of the window; 0 for none.
    directory: Vec<u32>,
    /// Number, plus one, of each brick of a page; 0 for none. Not used where pages are the blocks.
    bricks_of_pages: Vec<[u32; 512]>,
    /// Number of each block outside the window.
    far: FxHashMap<VoxelIndex, u32>,
    blocks: Vec<B>,
    /// Index of each block: its voxels' indices over its edge.
    indices: Vec<VoxelIndex>,
}

impl<B: Footprint> BlockMap<B> {
    /// Whether blocks are pages, and not bricks.
    const IS_OF_PAGES: bool = B::EDGE == PAGE_EDGE as u32;

    /// Forgets all blocks, and begins anew with another window; the memory is kept.
    pub(super) fn clear(&mut self, window: Window) {
        self.window = window;
        self.directory.clear();
        self.directory.resize(window.pages().map(|pages| pages as usize).iter().product(), 0);
        self.bricks_of_pages.clear();
        self.far.clear();
        self.blocks.clear();
        self.indices.clear();
    }

    /// Bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        self.directory.capacity() * size_of::<u32>()
            + self.bricks_of_pages.capacity() * size_of::<[u32; 512]>()
            + self.far.capacity() * 8 / 7 * (size_of::<(VoxelIndex, u32)>() + 1)
            + self.blocks.capacity() * size_of::<B>()
            + self.blocks.iter().map(B::heap_bytes).sum::<usize>()
            + self.indices.capacity() * size_of::<VoxelIndex>()
    }

    pub(super) fn window(&self) -> &Window {
        &self.window
    }

    /// The block that holds a voxel of the window.
    #[inline]
    pub(super) fn at(&mut self, voxel: Local) -> &mut B {
        let slot = match self.slot(voxel) {
            Some(slot) => slot,
            None => self.new_near(voxel),
        };
        &mut self.blocks[slot]
    }

    /// The number of the block that holds a voxel, wherever it is.
    pub(super) fn slot_of(&mut self, voxel: VoxelIndex) -> usize {
        if let Some(local) = self.window.local(voxel) {
            return self.slot(local).unwrap_or_else(|| self.new_near(local));
        }
        let index = voxel.map(|k| k.div_euclid(B::EDGE as i32));
        if let Some(&slot) = self.far.get(&index) {
            return slot as usize;
        }
        let slot = self.push(index);
        self.far.insert(index, slot as u32);
        slot
    }

    /// The blocks, by number.
    pub(super) fn blocks(&self) -> &[B] {
        &self.blocks
    }

    /// The blocks, by number, to change.
    pub(super) fn blocks_mut(&mut self) -> &mut [B] {
        &mut self.blocks
    }

    /// Index of each block, by number: its voxels' indices over its edge.
    pub(super) fn indices(&self) -> &[VoxelIndex] {
        &self.indices
    }

    #[inline]
    fn slot(&self, voxel: Local) -> Option<usize> {
        let page = (self.directory[self.window.page_of(voxel)] as usize).checked_sub(1)?;
        if Self::IS_OF_PAGES {
            return Some(page);
        }
        (self.bricks_of_pages[page][brick_in_page(voxel)] as usize).checked_sub(1)
    }

    #[cold]
    fn new_near(&mut self, voxel: Local) -> usize {
        let base = self.window.base();
        let slot = self.push(std::array::from_fn(|k| (base[k] + voxel[k] as i32).div_euclid(B::EDGE as i32)));
        let page = &mut self.directory[self.window.page_of(voxel)];
        if Self::IS_OF_PAGES {
            *page = self.blocks.len() as u32;
            return slot;
        }
        if *page == 0 {
            self.bricks_of_pages.push([0; 512]);
            *page = self.bricks_of_pages.len() as u32;
        }
        self.bricks_of_pages[*page as usize - 1][brick_in_page(voxel)] = self.blocks.len() as u32;
        slot
    }

    fn push(&mut self, index: VoxelIndex) -> usize {
        self.blocks.push(B::default());
        self.indices.push(index);
        self.blocks.len() - 1
    }
}

impl BlockMap<MarkedPage> {
    /// Whether all voxels from `low` to `high`, both in the window, are marked.
    #[inline]
    pub(super) fn are_marked(&self, low: Local, high: Local) -> bool {
        let is_one_page = (0..3).all(|k| (low[k] ^ high[k]) < PAGE_EDGE as u32);
        if is_one_page {
            return self.slot(low).is_some_and(|page| self.blocks[page].are_marked(low, high));
        }
        let is_marked =
            |voxel| self.slot(voxel).is_some_and(|page| self.blocks[page].are_marked(voxel, voxel));
        let [x, y, z] = [0, 1, 2].map(|k| low[k]..=high[k]);
        x.into_iter().all(|x| y.clone().all(|y| z.clone().all(|z| is_marked([x, y, z]))))
    }
}

/// Which of its page's bricks holds a voxel.
#[inline]
fn brick_in_page([x, y, z]: Local) -> usize {
    (x / 8 % 8 * 64 + y / 8 % 8 * 8 + z / 8 % 8) as usize
}
