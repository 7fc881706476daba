use super::counts::{Counts, Tally};
use super::place::{cell_at, ones, place_of};
use super::slab::Slab;
use super::sparse::{IdLists, Sparse64};
use rustc_hash::FxHashMap;
use voxtile::space::{VoxelIndex, hash_table_bytes};

/// Marks a missing page, node or block.
pub(super) const NONE: u32 = u32::MAX;

/// The voxels of a local map: a hash map of pages of 64 voxels per edge, divided into nodes of 16, divided into blocks
/// of 4. Empty cells do not exist, so that searches skip them at the largest size.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    by_index: FxHashMap<VoxelIndex, u32>,
    pub(super) pages: Slab<Page>,
    pub(super) nodes: Slab<Node>,
    pub(super) blocks: Slab<Block>,
    pub(super) lists: IdLists,
    pub(super) counts: Counts,
    /// Index and number of the page of the last block used.
    last_page: Option<(VoxelIndex, u32)>,
    /// Indices of pages with nodes that changed since the last publication.
    dirty: Vec<VoxelIndex>,
}

/// A cube of 64 x 64 x 64 voxels.
#[derive(Clone, Debug, Default)]
pub(super) struct Page {
    /// Index of any of its voxels, divided by 64.
    pub(super) index: VoxelIndex,
    pub(super) nodes: Sparse64,
    /// Mask of nodes that have stored voxels.
    pub(super) stored: u64,
    /// Mask of nodes in which voxels changed since the last publication.
    pub(super) dirty: u64,
    /// Number of occupied voxels.
    pub(super) occupied: u32,
    /// Number of voxels that inflate others.
    pub(super) inflating: u32,
}

/// A cube of 16 x 16 x 16 voxels.
#[derive(Clone, Debug, Default)]
pub(super) struct Node {
    pub(super) page: u32,
    pub(super) place: u8,
    /// Number of the inflation rule of the node.
    pub(super) rule: u8,
    /// Number of occupied voxels.
    pub(super) occupied: u16,
    /// Number of voxels that inflate others.
    pub(super) inflating: u16,
    pub(super) blocks: Sparse64,
    /// Mask of blocks that have stored voxels.
    pub(super) stored: u64,
    /// Mask of blocks in which voxels changed since the last publication.
    pub(super) dirty: u64,
}

/// A cube of 4 x 4 x 4 voxels, with their states and inflation counts. Fills half a cache line.
#[derive(Clone, Debug, Default)]
pub(super) struct Block {
    pub(super) node: u32,
    pub(super) place: u8,
    /// Whether the block is queued for an update of the inflation.
    pub(super) is_waiting: bool,
    /// The stored voxels, and their numbers.
    pub(super) voxels: Sparse64,
    pub(super) occupied: u64,
    /// Mask of the occupied voxels that inflate others, and the counts of inflation.
    pub(super) tally: Tally,
}

impl Tree {
    pub(super) fn page_at(&self, index: VoxelIndex) -> Option<u32> {
        self.by_index.get(&index).copied()
    }

    /// Returns the numbers of all pages.
    pub(super) fn page_ids(&self) -> impl Iterator<Item = u32> + '_ {
        self.by_index.values().copied()
    }

    /// Returns the index of the node: that of any of its voxels, divided by 16.
    pub(super) fn node_index(&self, node: u32) -> VoxelIndex {
        let Node { page, place, .. } = *self.nodes.get(node);
        cell_at(self.pages.get(page).index, place.into())
    }

    /// Returns the index of the block: that of any of its voxels, divided by 4.
    pub(super) fn block_index(&self, block: u32) -> VoxelIndex {
        let Block { node, place, .. } = *self.blocks.get(block);
        cell_at(self.node_index(node), place.into())
    }

    /// Returns the node with an index.
    pub(super) fn node_at(&self, index: VoxelIndex) -> Option<u32> {
        let page = self.page_at(index.map(|k| k >> 2))?;
        self.pages.get(page).nodes.get(&self.lists, place_of(index))
    }

    /// Returns the block with an index.
    #[inline]
    pub(super) fn block_at(&self, index: VoxelIndex) -> Option<u32> {
        let node = self.node_at(index.map(|k| k >> 2))?;
        self.nodes.get(node).blocks.get(&self.lists, place_of(index))
    }

    /// Returns the block with an index, created if it does not exist; a new node gets the rule.
    pub(super) fn make_block(&mut self, index: VoxelIndex, rule: u8) -> u32 {
        let node = self.make_node(index.map(|k| k >> 2), rule);
        self.make_block_in(node, place_of(index))
    }

    /// Returns the node with an index, created with the rule if it does not exist.
    pub(super) fn make_node(&mut self, index: VoxelIndex, rule: u8) -> u32 {
        let page = self.make_page(index.map(|k| k >> 2));
        let in_page = place_of(index);
        match self.pages.get(page).nodes.get(&self.lists, in_page) {
            Some(node) => node,
            None => {
                let node = self.nodes.insert(Node { page, place: in_page as u8, rule, ..Node::default() });
                self.pages.get_mut(page).nodes.insert(&mut self.lists, in_page, node);
                node
            }
        }
    }

    /// Returns the block at a position of a node, created if it does not exist.
    #[inline]
    pub(super) fn make_block_in(&mut self, node: u32, in_node: usize) -> u32 {
        match self.nodes.get(node).blocks.get(&self.lists, in_node) {
            Some(block) => block,
            None => {
                let block = Block { node, place: in_node as u8, ..Block::default() };
                let block = self.blocks.insert(block);
                self.nodes.get_mut(node).blocks.insert(&mut self.lists, in_node, block);
                block
            }
        }
    }

    #[inline]
    fn make_page(&mut self, index: VoxelIndex) -> u32 {
        // Usually the block is in the same page as the last one.
        if let Some((last, page)) = self.last_page
            && last == index
        {
            return page;
        }
        let page = self.page_at(index).unwrap_or_else(|| {
            let page = self.pages.insert(Page { index, ..Page::default() });
            self.by_index.insert(index, page);
            page
        });
        self.last_page = Some((index, page));
        page
    }

    /// Adds a stored voxel to a block.
    pub(super) fn store(&mut self, block: u32, place: usize, voxel: u32) {
        let Block { node, place: in_node, voxels, .. } = self.blocks.get_mut(block);
        voxels.insert(&mut self.lists, place, voxel);
        let Node { page, place: in_page, stored, .. } = self.nodes.get_mut(*node);
        *stored |= 1 << *in_node;
        self.pages.get_mut(*page).stored |= 1 << *in_page;
    }

    /// Removes a stored voxel from a block.
    pub(super) fn unstore(&mut self, block: u32, place: usize) {
        let Block { node, place: in_node, voxels, .. } = self.blocks.get_mut(block);
        voxels.remove(&mut self.lists, place);
        if voxels.mask == 0 {
            let Node { page, place: in_page, stored, .. } = self.nodes.get_mut(*node);
            *stored &= !(1 << *in_node);
            if *stored == 0 {
                self.pages.get_mut(*page).stored &= !(1 << *in_page);
            }
        }
    }

    /// Sets whether a voxel is occupied; returns whether the state changed.
    pub(super) fn set_occupied(&mut self, block: u32, place: usize, is_occupied: bool) -> bool {
        let Block { node, place: in_node, occupied, .. } = self.blocks.get_mut(block);
        let was_occupied = *occupied >> place & 1 != 0;
        if was_occupied == is_occupied {
            return false;
        }
        *occupied ^= 1 << place;
        let (number, in_node) = (*node, *in_node);
        let node = self.nodes.get_mut(number);
        let page = self.pages.get_mut(node.page);
        if is_occupied {
            (node.occupied, page.occupied) = (node.occupied + 1, page.occupied + 1);
        } else {
            (node.occupied, page.occupied) = (node.occupied - 1, page.occupied - 1);
        }
        self.mark_dirty(number, in_node);
        true
    }

    /// Changes which voxels of a block inflate others: those in `begin` start, those in `end` stop.
    pub(super) fn set_inflating(&mut self, block: u32, begin: u64, end: u64) {
        let Block { node, tally, .. } = *self.blocks.get(block);
        let inflating = (self.counts.inflating(tally) | begin) & !end;
        self.counts.set_inflating(tally, inflating);
        let (begin, end) = (begin.count_ones(), end.count_ones());
        let node = self.nodes.get_mut(node);
        // The number fits in 16 bits, because a node has 4096 voxels.
        node.inflating = (u32::from(node.inflating) + begin - end) as u16;
        let page = self.pages.get_mut(node.page);
        page.inflating = page.inflating + begin - end;
    }

    /// Marks the block at a position of a node as changed for readers.
    #[inline]
    pub(super) fn mark_dirty(&mut self, node: u32, in_node: u8) {
        let Node { page, place, dirty, .. } = self.nodes.get_mut(node);
        let (page, place, was_dirty) = (*page, *place, *dirty != 0);
        *dirty |= 1 << in_node;
        if was_dirty {
            return;
        }
        let Page { index, dirty, .. } = self.pages.get_mut(page);
        if *dirty == 0 {
            self.dirty.push(*index);
        }
        *dirty |= 1 << place;
    }

    /// Returns the indices of pages that may have changed for readers since the last call. Some pages may be gone, some
    /// may be listed twice.
    pub(super) fn take_dirty(&mut self) -> Vec<VoxelIndex> {
        std::mem::take(&mut self.dirty)
    }

    /// Marks these pages as published; reuses the memory in the next call of [`Tree::take_dirty`].
    pub(super) fn shown(&mut self, mut dirty: Vec<VoxelIndex>) {
        for index in dirty.drain(..) {
            let Some(page) = self.page_at(index) else { continue };
            let Page { nodes, dirty, .. } = self.pages.get_mut(page);
            for place in ones(std::mem::take(dirty)) {
                if let Some(node) = nodes.get(&self.lists, place) {
                    self.nodes.get_mut(node).dirty = 0;
                }
            }
        }
        self.dirty = dirty;
    }

    /// Removes a block if it is empty, and its node and page if they are empty as well.
    ///
    /// Publish the tree before creating new nodes or blocks: a new node has no record of the blocks of a removed node
    /// that readers still see at its position.
    pub(super) fn drop_if_empty(&mut self, block: u32) {
        let Block { node, place, voxels, tally, .. } = self.blocks.get(block).clone();
        if voxels.mask != 0 || !tally.is_empty() {
            return;
        }
        self.blocks.remove(block);
        let Node { page, place: in_page, blocks, .. } = self.nodes.get_mut(node);
        blocks.remove(&mut self.lists, place.into());
        if blocks.mask != 0 {
            return;
        }
        let (page, in_page) = (*page, usize::from(*in_page));
        self.nodes.remove(node);
        let Page { index, nodes, .. } = self.pages.get_mut(page);
        nodes.remove(&mut self.lists, in_page);
        if nodes.mask == 0 {
            self.by_index.remove(index);
            self.last_page = None;
            self.pages.remove(page);
        }
    }

    /// Returns the numbers of all nodes of a page.
    pub(super) fn nodes_of(&self, page: u32) -> &[u32] {
        self.pages.get(page).nodes.ids(&self.lists)
    }

    /// Returns the numbers of all blocks of a node.
    pub(super) fn blocks_of(&self, node: u32) -> &[u32] {
        self.nodes.get(node).blocks.ids(&self.lists)
    }

    /// Returns the number of stored voxels that are not inflated.
    pub(super) fn stored_but_not_inflated(&self) -> usize {
        let nodes = self.page_ids().flat_map(|page| self.nodes_of(page));
        let blocks = nodes.flat_map(|&node| self.blocks_of(node)).map(|&block| self.blocks.get(block));
        blocks
            .map(|block| (block.voxels.mask & !self.counts.inflated(block.tally)).count_ones() as usize)
            .sum()
    }

    /// Returns bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        hash_table_bytes::<(VoxelIndex, u32)>(self.by_index.capacity())
            + self.pages.bytes()
            + self.nodes.bytes()
            + self.blocks.bytes()
            + self.lists.bytes()
            + self.counts.bytes()
            + self.dirty.capacity() * size_of::<VoxelIndex>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_half_a_cache_line() {
        assert_eq!((size_of::<Block>(), size_of::<Node>()), (32, 40));
    }
}
