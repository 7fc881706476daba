use super::footprint::Footprint;
use super::marked_page::MarkedPage;
use super::window::{Local, PAGE_EDGE, Window};
use crate::space::{VoxelIndex, hash_table_bytes};
use rustc_hash::FxHashMap;

/// Pages that the rays of a scan write to.
///
/// In the window around the sensor, which contains almost all pages, a page is found by one look-up in a table;
/// outside, in a hash map.
#[derive(Clone, Debug, Default)]
pub(crate) struct PageMap<F> {
    window: Window,
    /// Number of each page of the window, from 1; 0 if it does not exist.
    directory: Vec<u32>,
    /// Number of each page outside the window.
    far: FxHashMap<VoxelIndex, u32>,
    pages: Vec<F>,
    /// Index of each page: the indices of its voxels divided by 64.
    indices: Vec<VoxelIndex>,
    /// Cleared pages of earlier scans, for reuse.
    spare: Vec<F>,
    /// Number of pages that may have the fast form; later ones get the small form.
    max_fast: usize,
}

impl<F: Footprint> PageMap<F> {
    /// Removes all pages and sets another window with up to `max_fast` fast pages; the memory is kept.
    pub(crate) fn clear(&mut self, window: Window, max_fast: usize) {
        self.window = window;
        self.max_fast = max_fast;
        self.directory.clear();
        self.directory.resize(window.count(), 0);
        self.far.clear();
        // Keep at most as many pages as the last scan had, so that a scan with distant stray rays does not occupy
        // memory permanently. Only fast pages are kept, so at most `max_fast`.
        self.spare.clear();
        self.spare.extend(self.pages.drain(..).take(max_fast).filter_map(F::cleared));
        self.indices.clear();
    }

    /// Removes the pages from this number on and returns them with their indices.
    pub(crate) fn take_from(&mut self, first: usize) -> Vec<(VoxelIndex, F)> {
        let first = first.min(self.pages.len());
        for &index in &self.indices[first..] {
            let voxel = index.map(|k| k.wrapping_mul(PAGE_EDGE as i32));
            match self.window.local(voxel) {
                Some(local) => self.directory[self.window.page_of(local)] = 0,
                None => drop(self.far.remove(&index)),
            }
        }
        self.indices.drain(first..).zip(self.pages.drain(first..)).collect()
    }

    /// Number of the first small page.
    pub(crate) fn first_small(&self) -> usize {
        self.max_fast.min(self.pages.len())
    }

    pub(crate) fn bytes(&self) -> usize {
        self.directory.capacity() * size_of::<u32>()
            + hash_table_bytes::<(VoxelIndex, u32)>(self.far.capacity())
            + (self.pages.capacity() + self.spare.capacity()) * size_of::<F>()
            + self.pages.iter().chain(&self.spare).map(F::heap_bytes).sum::<usize>()
            + self.indices.capacity() * size_of::<VoxelIndex>()
    }

    pub(crate) fn window(&self) -> &Window {
        &self.window
    }

    /// The page that contains a voxel of the window.
    #[inline]
    pub(crate) fn at(&mut self, voxel: Local) -> &mut F {
        let number = self.number_at(voxel);
        &mut self.pages[number]
    }

    /// The number of the page that contains a voxel of the window.
    #[inline]
    pub(crate) fn number_at(&mut self, voxel: Local) -> usize {
        match self.directory[self.window.page_of(voxel)] {
            0 => self.new_near(voxel),
            number => number as usize - 1,
        }
    }

    /// The number of the page that contains a voxel, inside or outside the window.
    pub(crate) fn number_of(&mut self, voxel: VoxelIndex) -> usize {
        if let Some(local) = self.window.local(voxel) {
            return self.number_at(local);
        }
        let index = voxel.map(|k| k.div_euclid(PAGE_EDGE as i32));
        if let Some(&number) = self.far.get(&index) {
            return number as usize;
        }
        let number = self.push(index);
        self.far.insert(index, number as u32);
        number
    }

    /// The number of the page with an index, if it exists.
    #[inline]
    pub(crate) fn find(&self, index: VoxelIndex) -> Option<usize> {
        match self.window.local(index.map(|k| k.wrapping_mul(PAGE_EDGE as i32))) {
            Some(local) => (self.directory[self.window.page_of(local)] as usize).checked_sub(1),
            None => self.far.get(&index).map(|&number| number as usize),
        }
    }

    pub(crate) fn pages(&self) -> &[F] {
        &self.pages
    }

    pub(crate) fn pages_mut(&mut self) -> &mut [F] {
        &mut self.pages
    }

    /// Index of each page: the indices of its voxels divided by 64.
    pub(crate) fn indices(&self) -> &[VoxelIndex] {
        &self.indices
    }

    #[cold]
    fn new_near(&mut self, voxel: Local) -> usize {
        let base = self.window.base();
        let index = |k: usize| (base[k] + voxel[k] as i32).div_euclid(PAGE_EDGE as i32);
        let number = self.push(std::array::from_fn(index));
        self.directory[self.window.page_of(voxel)] = self.pages.len() as u32;
        number
    }

    fn push(&mut self, index: VoxelIndex) -> usize {
        let new = || if self.pages.len() < self.max_fast { F::default() } else { F::sparse() };
        let page = self.spare.pop().unwrap_or_else(new);
        self.pages.push(page);
        self.indices.push(index);
        self.pages.len() - 1
    }
}

impl PageMap<MarkedPage> {
    /// Returns whether all voxels from `low` to `high`, both in the window, are marked.
    #[inline]
    pub(crate) fn are_marked(&self, low: Local, high: Local) -> bool {
        let page =
            |voxel| self.pages.get((self.directory[self.window.page_of(voxel)] as usize).wrapping_sub(1));
        let is_one_page = (0..3).all(|k| (low[k] ^ high[k]) < PAGE_EDGE as u32);
        if is_one_page {
            return page(low).is_some_and(|page| page.are_marked(low, high));
        }
        let is_marked = |voxel| page(voxel).is_some_and(|page| page.are_marked(voxel, voxel));
        let [x, y, z] = [0, 1, 2].map(|k| low[k]..=high[k]);
        x.into_iter().all(|x| y.clone().all(|y| z.clone().all(|z| is_marked([x, y, z]))))
    }
}
