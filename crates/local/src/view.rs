use super::place::{cell_at, ones, place_of};
use super::tree::{Node, Page, Tree};
use rustc_hash::FxHashMap;
use std::sync::Arc;
use voxtile::space::{Grid, Point, VoxelIndex, hash_table_bytes};

/// Immutable state of a local map after one update, for queries.
///
/// Views share the pages that did not change between them.
#[derive(Clone, Debug)]
pub struct LocalView {
    pub(super) grid: Grid,
    pub(super) update_number: u64,
    pub(super) position: Option<Point>,
    pub(super) stored: usize,
    pub(super) occupied: usize,
    pub(super) inflated: usize,
    /// Pages by the index of any of their voxels, divided by 64.
    pub(super) pages: FxHashMap<VoxelIndex, Arc<PageView>>,
}

/// A page: 4 x 4 x 4 nodes.
#[derive(Clone, Debug, Default)]
pub(super) struct PageView {
    pub(super) mask: u64,
    /// For each node of the mask: the mask of its blocks, and the number of blocks before them.
    nodes: Box<[(u64, u32)]>,
    /// Blocks of all nodes.
    blocks: Box<[BlockView]>,
}

/// A node: 4 x 4 x 4 blocks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NodeView<'a> {
    pub(super) mask: u64,
    /// Blocks in the order of the mask.
    blocks: &'a [BlockView],
}

/// A block: 4 x 4 x 4 voxels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct BlockView {
    pub(super) occupied: u64,
    pub(super) inflated: u64,
}

/// State of a voxel in a local map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LocalState {
    /// Neither occupied nor inflated: free or unknown; the local map does not distinguish these.
    None,
    /// Not occupied, but within the inflation radius of an occupied voxel.
    Inflated,
    /// Occupied.
    Occupied,
}

/// Selects the voxels that are obstacles for a query.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Obstacle {
    /// Occupied voxels only.
    Occupied,
    /// Occupied and inflated voxels: a point robot must avoid them.
    #[default]
    Inflated,
}

impl Obstacle {
    /// Returns whether a state is an obstacle.
    pub fn is(self, state: LocalState) -> bool {
        match self {
            Self::Occupied => state == LocalState::Occupied,
            Self::Inflated => state != LocalState::None,
        }
    }
}

impl BlockView {
    pub(super) fn state(&self, place: usize) -> LocalState {
        if self.occupied >> place & 1 != 0 {
            LocalState::Occupied
        } else if self.inflated >> place & 1 != 0 {
            LocalState::Inflated
        } else {
            LocalState::None
        }
    }

    /// Returns the mask of voxels that are obstacles.
    pub(super) fn obstacles(&self, obstacle: Obstacle) -> u64 {
        match obstacle {
            Obstacle::Occupied => self.occupied,
            Obstacle::Inflated => self.occupied | self.inflated,
        }
    }
}

/// Returns the value of a position. `values` has one value for each position of the mask.
fn at<T>(values: &[T], mask: u64, place: usize) -> Option<&T> {
    let rank = (mask & ((1 << place) - 1)).count_ones() as usize;
    (mask >> place & 1 != 0).then(|| &values[rank])
}

impl PageView {
    #[inline]
    pub(super) fn node(&self, place: usize) -> Option<NodeView<'_>> {
        at(&self.nodes, self.mask, place).map(|node| self.view_of(node))
    }

    #[inline]
    fn view_of(&self, &(mask, before): &(u64, u32)) -> NodeView<'_> {
        NodeView { mask, blocks: &self.blocks[before as usize..][..mask.count_ones() as usize] }
    }

    /// Returns the nodes of the mask.
    fn nodes(&self) -> impl Iterator<Item = NodeView<'_>> {
        self.nodes.iter().map(|node| self.view_of(node))
    }

    /// Returns the bytes of memory on the heap, including the reference counts.
    fn bytes(&self) -> usize {
        2 * size_of::<usize>()
            + size_of::<Self>()
            + size_of_val::<[(u64, u32)]>(&self.nodes)
            + size_of_val::<[BlockView]>(&self.blocks)
    }
}

impl<'a> NodeView<'a> {
    #[inline]
    pub(super) fn block(&self, place: usize) -> Option<&'a BlockView> {
        at(self.blocks, self.mask, place)
    }
}

/// Builds views of pages; reused to avoid allocations.
#[derive(Default)]
struct PageBuilder {
    nodes: Vec<(u64, u32)>,
    blocks: Vec<BlockView>,
}

impl PageBuilder {
    /// Returns the view of a page; `before` is its last view. `None` if nothing in it is occupied or inflated.
    fn build(&mut self, tree: &Tree, page: &Page, before: Option<&PageView>) -> Option<PageView> {
        self.nodes.clear();
        self.blocks.clear();
        let mut mask = 0;
        for (place, &node) in ones(page.nodes.mask).zip(page.nodes.ids(&tree.lists)) {
            let first = self.blocks.len();
            let before = before.and_then(|page| page.node(place)).unwrap_or_default();
            let of_node = if page.dirty >> place & 1 != 0 {
                self.add_blocks_of(tree, node, before)
            } else {
                self.blocks.extend_from_slice(before.blocks);
                before.mask
            };
            if of_node != 0 {
                mask |= 1 << place;
                self.nodes.push((of_node, first as u32));
            }
        }
        let (nodes, blocks) = (self.nodes.as_slice().into(), self.blocks.as_slice().into());
        (mask != 0).then_some(PageView { mask, nodes, blocks })
    }

    /// Adds the visible blocks of a node; `before` is its last view. Returns their mask.
    fn add_blocks_of(&mut self, tree: &Tree, node: u32, before: NodeView) -> u64 {
        let Node { blocks, dirty, .. } = tree.nodes.get(node);
        // Most blocks are not in the cache. Reading all of them before the first decision overlaps the cache misses.
        let changed = ones(blocks.mask & dirty).filter_map(|place| blocks.get(&tree.lists, place));
        std::hint::black_box(changed.fold(0, |any, id| any | tree.blocks.get(id).occupied));
        // Unchanged blocks are copied from the last view, where they are contiguous.
        let mut unchanged = ones(before.mask).zip(before.blocks).filter(|(place, _)| dirty >> place & 1 == 0);
        let mut mask = before.mask & !dirty;
        let mut next = unchanged.next();
        for place in ones(mask | (blocks.mask & dirty)) {
            if let Some((_, block)) = next.filter(|(at, _)| *at == place) {
                self.blocks.push(*block);
                next = unchanged.next();
                continue;
            }
            let Some(id) = blocks.get(&tree.lists, place) else { continue };
            let block = tree.blocks.get(id);
            let (occupied, inflated) = (block.occupied, tree.counts.inflated(block.tally));
            if occupied | inflated != 0 {
                mask |= 1 << place;
                self.blocks.push(BlockView { occupied, inflated });
            }
        }
        mask
    }
}

impl LocalView {
    pub(super) fn empty(grid: Grid) -> Self {
        let pages = FxHashMap::default();
        Self { grid, update_number: 0, position: None, stored: 0, occupied: 0, inflated: 0, pages }
    }

    /// Replaces the pages with these indices.
    pub(super) fn replace_pages(&mut self, tree: &Tree, dirty: &[VoxelIndex]) {
        let mut builder = PageBuilder::default();
        for &index in dirty {
            let before = self.pages.get(&index).map(|page| &**page);
            let page = tree.page_at(index).map(|page| tree.pages.get(page));
            match page.and_then(|page| builder.build(tree, page, before)) {
                Some(page) => drop(self.pages.insert(index, Arc::new(page))),
                None => drop(self.pages.remove(&index)),
            }
        }
    }

    /// Returns the number of the update that this view shows; 0 before the first.
    pub fn update_number(&self) -> u64 {
        self.update_number
    }

    /// Returns the position of the sensor at that update, in metres; `None` before the first.
    pub fn position(&self) -> Option<Point> {
        self.position
    }

    /// Returns the edge length of a voxel in metres.
    pub fn resolution_m(&self) -> f64 {
        self.grid.resolution_m()
    }

    /// Returns the number of stored voxels: occupied, or not yet known to be free.
    pub fn stored_voxels(&self) -> usize {
        self.stored
    }

    /// Returns the number of occupied voxels.
    pub fn occupied_voxels(&self) -> usize {
        self.occupied
    }

    /// Returns the number of inflated voxels, including occupied ones.
    pub fn inflated_voxels(&self) -> usize {
        self.inflated
    }

    /// Returns the state of a voxel.
    pub fn state(&self, voxel: VoxelIndex) -> LocalState {
        let place = |shift: u32| place_of(voxel.map(|k| k >> shift));
        let page = self.pages.get(&voxel.map(|k| k >> 6));
        let block = page.and_then(|page| page.node(place(4))).and_then(|node| node.block(place(2)));
        block.map_or(LocalState::None, |block| block.state(place(0)))
    }

    /// Returns the state of the voxel that contains a point; [`LocalState::None`] if the point is not finite.
    pub fn state_at(&self, point: Point) -> LocalState {
        self.grid.voxel_of(point).map_or(LocalState::None, |voxel| self.state(voxel))
    }

    /// Visits all voxels that are occupied or inflated, in no particular order.
    pub fn for_each(&self, mut visit: impl FnMut(VoxelIndex, LocalState)) {
        for (index, page) in &self.pages {
            for (place, node) in ones(page.mask).zip(page.nodes()) {
                let node_index = cell_at(*index, place);
                for (place, block) in ones(node.mask).zip(node.blocks) {
                    let block_index = cell_at(node_index, place);
                    ones(block.occupied | block.inflated)
                        .for_each(|place| visit(cell_at(block_index, place), block.state(place)));
                }
            }
        }
    }

    /// Returns the bytes of memory on the heap. Pages that views share are counted in full.
    pub(super) fn bytes(&self) -> usize {
        hash_table_bytes::<(VoxelIndex, Arc<PageView>)>(self.pages.capacity())
            + self.pages.values().map(|page| page.bytes()).sum::<usize>()
    }
}
