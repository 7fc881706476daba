use super::place::{cell_at, ones, place_of};
use super::tree::{Node, Tree};
use crate::space::{Grid, Point, VoxelIndex};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// What a local map is after one update. It never changes: a planner can ask it as long as it likes.
///
/// What did not change from one update to the next is shared between their views.
#[derive(Clone, Debug)]
pub struct LocalView {
    pub(super) grid: Grid,
    pub(super) update_number: u64,
    pub(super) position: Option<Point>,
    pub(super) stored: usize,
    pub(super) occupied: usize,
    pub(super) inflated: usize,
    /// By index of a voxel over 64.
    pub(super) pages: FxHashMap<VoxelIndex, Arc<PageView>>,
}

/// 4 x 4 x 4 nodes.
#[derive(Clone, Debug, Default)]
pub(super) struct PageView {
    pub(super) mask: u64,
    /// The nodes of the mask.
    nodes: Box<[Arc<NodeView>]>,
}

/// 4 x 4 x 4 blocks.
#[derive(Clone, Debug, Default)]
pub(super) struct NodeView {
    pub(super) mask: u64,
    /// The blocks of the mask.
    blocks: Box<[BlockView]>,
}

/// 4 x 4 x 4 voxels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct BlockView {
    pub(super) occupied: u64,
    pub(super) inflated: u64,
}

/// What a local map says of a voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LocalState {
    /// Neither occupied nor inflated: free, or never seen; the local map does not tell these apart.
    None,
    /// Not occupied, but near to an occupied voxel.
    Inflated,
    /// Occupied.
    Occupied,
}

/// Which voxels are obstacles for a question.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Obstacle {
    /// Occupied voxels alone.
    Occupied,
    /// Occupied and inflated voxels: what a planner for a point robot avoids.
    #[default]
    Inflated,
}

impl Obstacle {
    /// Whether a state is an obstacle.
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

    /// The voxels that are obstacles.
    pub(super) fn obstacles(&self, obstacle: Obstacle) -> u64 {
        match obstacle {
            Obstacle::Occupied => self.occupied,
            Obstacle::Inflated => self.occupied | self.inflated,
        }
    }
}

/// The value at a place among those of a mask.
fn at<T>(values: &[T], mask: u64, place: usize) -> Option<&T> {
    let rank = (mask & ((1 << place) - 1)).count_ones() as usize;
    (mask >> place & 1 != 0).then(|| &values[rank])
}

impl PageView {
    #[inline]
    pub(super) fn node(&self, place: usize) -> Option<&Arc<NodeView>> {
        at(&self.nodes, self.mask, place)
    }
}

impl NodeView {
    #[inline]
    pub(super) fn block(&self, place: usize) -> Option<&BlockView> {
        at(&self.blocks, self.mask, place)
    }

    fn of(tree: &Tree, node: &Node) -> Self {
        let mut view = Self::default();
        let mut blocks = Vec::with_capacity(node.blocks.mask.count_ones() as usize);
        for (place, &id) in ones(node.blocks.mask).zip(node.blocks.ids(&tree.lists)) {
            let block = tree.blocks.get(id);
            let (occupied, inflated) = (block.occupied, block.inflated);
            if occupied | inflated != 0 {
                view.mask |= 1 << place;
                blocks.push(BlockView { occupied, inflated });
            }
        }
        view.blocks = blocks.into_boxed_slice();
        view
    }
}

impl LocalView {
    pub(super) fn empty(grid: Grid) -> Self {
        let pages = FxHashMap::default();
        Self { grid, update_number: 0, position: None, stored: 0, occupied: 0, inflated: 0, pages }
    }

    /// Takes over the nodes with these indices.
    pub(super) fn replace_nodes(&mut self, tree: &Tree, dirty: &[VoxelIndex]) {
        let mut by_page: FxHashMap<VoxelIndex, Vec<VoxelIndex>> = FxHashMap::default();
        for &index in dirty {
            by_page.entry(index.map(|k| k >> 2)).or_default().push(index);
        }
        for (index, dirty) in by_page {
            let mut nodes: [Option<Arc<NodeView>>; 64] = [const { None }; 64];
            if let Some(page) = self.pages.get(&index) {
                ones(page.mask).zip(&page.nodes).for_each(|(place, node)| nodes[place] = Some(node.clone()));
            }
            for node in dirty {
                let view = tree.node_at(node).map(|id| NodeView::of(tree, tree.nodes.get(id)));
                nodes[place_of(node)] = view.filter(|view| view.mask != 0).map(Arc::new);
            }
            let mask =
                (0..64).filter(|&place| nodes[place].is_some()).fold(0, |mask, place| mask | 1 << place);
            match mask {
                0 => drop(self.pages.remove(&index)),
                _ => {
                    let nodes = nodes.into_iter().flatten().collect();
                    self.pages.insert(index, Arc::new(PageView { mask, nodes }));
                }
            }
        }
    }

    /// Number of the update that led to this; 0 before the first.
    pub fn update_number(&self) -> u64 {
        self.update_number
    }

    /// Where the sensor was at that update, in metres; `None` before the first.
    pub fn position(&self) -> Option<Point> {
        self.position
    }

    /// Edge of a voxel in metres.
    pub fn resolution_m(&self) -> f64 {
        self.grid.resolution_m()
    }

    /// Voxels with occupancy: occupied, or not yet known to be free.
    pub fn stored_voxels(&self) -> usize {
        self.stored
    }

    /// Occupied voxels.
    pub fn occupied_voxels(&self) -> usize {
        self.occupied
    }

    /// Inflated voxels, occupied ones among them.
    pub fn inflated_voxels(&self) -> usize {
        self.inflated
    }

    /// What the map says of a voxel.
    pub fn state(&self, voxel: VoxelIndex) -> LocalState {
        let place = |shift: u32| place_of(voxel.map(|k| k >> shift));
        let page = self.pages.get(&voxel.map(|k| k >> 6));
        let block = page.and_then(|page| page.node(place(4))).and_then(|node| node.block(place(2)));
        block.map_or(LocalState::None, |block| block.state(place(0)))
    }

    /// What the map says of the voxel that holds a point; of what is no point, nothing.
    pub fn state_at(&self, point: Point) -> LocalState {
        self.grid.voxel_of(point).map_or(LocalState::None, |voxel| self.state(voxel))
    }

    /// Visits all voxels that are occupied or inflated, in no stated order.
    pub fn for_each(&self, mut visit: impl FnMut(VoxelIndex, LocalState)) {
        for (index, page) in &self.pages {
            for (place, node) in ones(page.mask).zip(&page.nodes) {
                let node_index = cell_at(*index, place);
                for (place, block) in ones(node.mask).zip(&node.blocks) {
                    let block_index = cell_at(node_index, place);
                    ones(block.occupied | block.inflated)
                        .for_each(|place| visit(cell_at(block_index, place), block.state(place)));
                }
            }
        }
    }

    /// Bytes of memory on the heap, were none of it shared with other views.
    pub(super) fn bytes(&self) -> usize {
        let counts = 2 * size_of::<usize>();
        let of_node = |node: &Arc<NodeView>| {
            counts
                + size_of::<NodeView>()
                + size_of_val::<[BlockView]>(&node.blocks)
                + size_of::<Arc<NodeView>>()
        };
        let of_page = |page: &Arc<PageView>| {
            counts + size_of::<PageView>() + page.nodes.iter().map(of_node).sum::<usize>()
        };
        self.pages.capacity() * 8 / 7 * (size_of::<(VoxelIndex, Arc<PageView>)>() + 1)
            + self.pages.values().map(of_page).sum::<usize>()
    }
}
