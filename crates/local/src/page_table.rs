use super::tree::{NONE, Tree};
use voxtile::space::VoxelIndex;

/// Dense table of the pages with occupied voxels: avoids hash lookups while the rays of a scan are traced.
#[derive(Debug, Default)]
pub(super) struct PageTable {
    min: VoxelIndex,
    size: [u32; 3],
    /// Number of each page of the box; [`NONE`] if it does not exist.
    pages: Vec<u32>,
}

/// Largest box, in pages, that is tabulated; beyond it pages are looked up in the tree.
const MAX_PAGES_IN_BOX: u64 = 1 << 18;

impl PageTable {
    /// Rebuilds the table from a tree.
    pub(super) fn refill(&mut self, tree: &Tree) {
        let stored = || tree.page_ids().filter(|page| tree.pages.get(*page).stored != 0);
        let (mut low, mut high) = ([i32::MAX; 3], [i32::MIN; 3]);
        for index in stored().map(|page| tree.pages.get(page).index) {
            low = std::array::from_fn(|k| low[k].min(index[k]));
            high = std::array::from_fn(|k| high[k].max(index[k]));
        }
        self.pages.clear();
        self.min = low;
        self.size = std::array::from_fn(|k| if high[k] < low[k] { 0 } else { high[k].abs_diff(low[k]) + 1 });
        let size = self.size.map(u64::from).into_iter().fold(1, u64::saturating_mul);
        if size > MAX_PAGES_IN_BOX {
            return;
        }
        self.pages.resize(size as usize, NONE);
        for page in stored() {
            if let Some(place) = self.place(tree.pages.get(page).index) {
                self.pages[place] = page;
            }
        }
    }

    #[inline]
    fn place(&self, index: VoxelIndex) -> Option<usize> {
        let [x, y, z]: [u32; 3] = std::array::from_fn(|k| index[k].wrapping_sub(self.min[k]) as u32);
        let [width, height, depth] = self.size;
        // This overflows only for boxes that are too large for the table; their pages are looked up in the tree.
        let place = x.wrapping_mul(height).wrapping_add(y).wrapping_mul(depth).wrapping_add(z);
        (x < width && y < height && z < depth).then_some(place as usize)
    }

    /// Returns the page with an index if it has stored voxels.
    #[inline]
    pub(super) fn get(&self, tree: &Tree, index: VoxelIndex) -> Option<u32> {
        let place = self.place(index)?;
        match self.pages.get(place) {
            Some(&NONE) => None,
            Some(&page) => Some(page),
            None => tree.page_at(index).filter(|page| tree.pages.get(*page).stored != 0),
        }
    }

    /// Returns bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        self.pages.capacity() * size_of::<u32>()
    }
}
