use super::nodes_around::NodesAround;
use super::place::{cell_at, ones, place_of};
use super::range::{Ball, Relation};
use super::rules::Rules;
use super::stencil::Stencil;
use super::tree::{NONE, Node, Tree};
use std::sync::Arc;
use voxtile::space::{Grid, Point, VoxelIndex};

/// The inflated set: the dilation of the occupied voxels in range.
///
/// It is updated incrementally: a voxel that starts to inflate adds one to the counts of its stencil, and subtracts it
/// again when it stops.
#[derive(Clone, Debug)]
pub(super) struct Inflation {
    pub(super) rules: Rules,
    /// Blocks whose occupied voxels have changed.
    waiting: Vec<u32>,
    /// Blocks to check for removal.
    emptied: Vec<u32>,
    /// Numbers of the blocks around the current block, in the order of [`Stencil::offset_of`].
    affected: Vec<u32>,
    nodes: NodesAround,
    pages: Vec<u32>,
    /// Number of inflated voxels.
    pub(super) inflated: usize,
    /// Number of voxels that started or stopped inflating others since the last reset.
    pub(super) changes: usize,
}

impl Inflation {
    pub(super) fn new(range_m: f64, radius_m: f64, resolution_m: f64) -> Self {
        Self {
            rules: Rules::new(range_m, radius_m, resolution_m),
            waiting: Vec::new(),
            emptied: Vec::new(),
            affected: Vec::new(),
            nodes: NodesAround::default(),
            pages: Vec::new(),
            inflated: 0,
            changes: 0,
        }
    }

    /// Assigns the current rule to a node; it takes effect at the next [`Inflation::update`].
    pub(super) fn adopt(&mut self, tree: &mut Tree, node: u32) {
        let (old, new) = (tree.nodes.get(node).rule, self.rules.current());
        if old == new {
            return;
        }
        let (before, after) = (self.rules.stencil(old), self.rules.stencil(new));
        for block in tree.blocks_of(node).to_vec() {
            if !Arc::ptr_eq(&before, &after) {
                let inflating = tree.counts.inflating(tree.blocks.get(block).tally);
                self.change(tree, block, 0, inflating, &before);
            }
            self.wait(tree, block);
        }
        tree.nodes.get_mut(node).rule = new;
    }

    /// Queues a block whose occupied voxels have changed.
    #[inline]
    pub(super) fn wait(&mut self, tree: &mut Tree, block: u32) {
        if !std::mem::replace(&mut tree.blocks.get_mut(block).is_waiting, true) {
            self.waiting.push(block);
        }
    }

    /// Queues a block to be removed if it is empty.
    pub(super) fn may_be_empty(&mut self, block: u32) {
        self.emptied.push(block);
    }

    /// Updates the inflated set for blocks that changed and for voxels that entered or left the range of the sensor at
    /// `position`. `has_old_rules`: some nodes may still have an older rule.
    pub(super) fn update(&mut self, tree: &mut Tree, grid: Grid, position: Point, has_old_rules: bool) {
        let mut waiting = std::mem::take(&mut self.waiting);
        for block in waiting.drain(..) {
            tree.blocks.get_mut(block).is_waiting = false;
            let ball = self.rules.ball(tree.nodes.get(tree.blocks.get(block).node).rule, grid, position);
            self.reconcile(tree, block, &ball, Relation::Border);
        }
        self.waiting = waiting;
        let mut pages = std::mem::take(&mut self.pages);
        pages.extend(tree.page_ids());
        for page in pages.drain(..) {
            self.update_page(tree, grid, position, page, has_old_rules);
        }
        self.pages = pages;
        let mut emptied = std::mem::take(&mut self.emptied);
        emptied.sort_unstable();
        emptied.dedup();
        emptied.drain(..).for_each(|block| tree.drop_if_empty(block));
        self.emptied = emptied;
        self.nodes = NodesAround::default();
    }

    fn update_page(&mut self, tree: &mut Tree, grid: Grid, position: Point, page: u32, has_old_rules: bool) {
        let (index, occupied, inflating) = {
            let page = tree.pages.get(page);
            (page.index, page.occupied, page.inflating)
        };
        if occupied == 0 && inflating == 0 {
            return;
        }
        if !has_old_rules {
            match self.rules.ball(self.rules.current(), grid, position).relation(index.map(|k| k << 6), 64) {
                Relation::Inside if inflating == occupied => return,
                Relation::Outside if inflating == 0 => return,
                _ => {}
            }
        }
        for place in ones(tree.pages.get(page).nodes.mask) {
            if let Some(node) = tree.pages.get(page).nodes.get(&tree.lists, place) {
                self.update_node(tree, grid, position, node);
            }
        }
    }

    fn update_node(&mut self, tree: &mut Tree, grid: Grid, position: Point, node: u32) {
        let Node { rule, occupied, inflating, .. } = *tree.nodes.get(node);
        if occupied == 0 && inflating == 0 {
            return;
        }
        let ball = self.rules.ball(rule, grid, position);
        let relation = ball.relation(tree.node_index(node).map(|k| k << 4), 16);
        match relation {
            Relation::Inside if inflating == occupied => return,
            Relation::Outside if inflating == 0 => return,
            _ => {}
        }
        // Blocks that this loop adds are not visited: they have no occupied voxels, which alone can inflate others.
        for place in ones(tree.nodes.get(node).blocks.mask) {
            if let Some(block) = tree.nodes.get(node).blocks.get(&tree.lists, place) {
                self.reconcile(tree, block, &ball, relation);
            }
        }
    }

    /// Recomputes which voxels of a block inflate others. `relation` is the position of a cube that contains the block,
    /// relative to `ball`.
    fn reconcile(&mut self, tree: &mut Tree, block: u32, ball: &Ball, relation: Relation) {
        let (occupied, inflating) = {
            let block = tree.blocks.get(block);
            (block.occupied, tree.counts.inflating(block.tally))
        };
        if occupied | inflating == 0 || (relation == Relation::Inside && occupied == inflating) {
            return;
        }
        let index = tree.block_index(block);
        let relation = match relation {
            Relation::Border => ball.relation(index.map(|k| k << 2), 4),
            certain => certain,
        };
        let wanted = match relation {
            Relation::Inside => occupied,
            Relation::Outside => 0,
            Relation::Border => in_ball(occupied, index, ball),
        };
        if wanted != inflating {
            let stencil = self.rules.stencil(tree.nodes.get(tree.blocks.get(block).node).rule);
            self.change(tree, block, wanted & !inflating, inflating & !wanted, &stencil);
        }
    }

    /// Starts the inflation by the voxels `begin` of a block, and stops the inflation by its voxels `end`.
    fn change(&mut self, tree: &mut Tree, block: u32, begin: u64, end: u64, stencil: &Stencil) {
        self.affected.clear();
        self.affected.resize(stencil.blocks(), NONE);
        let index = tree.block_index(block);
        self.nodes.move_to(index.map(|k| k >> 2));
        self.find_affected(tree, index, begin | end, stencil);
        for place in ones(begin) {
            for &(number, mask) in stencil.of_place(place) {
                self.count_up(tree, self.affected[number as usize], mask);
            }
        }
        for place in ones(end) {
            for &(number, mask) in stencil.of_place(place) {
                self.count_down(tree, self.affected[number as usize], mask);
            }
        }
        tree.set_inflating(block, begin, end);
        self.changes += (begin.count_ones() + end.count_ones()) as usize;
    }

    /// Finds or creates the blocks that voxels of the block at `index` inflate.
    #[inline]
    fn find_affected(&mut self, tree: &mut Tree, index: VoxelIndex, voxels: u64, stencil: &Stencil) {
        for place in ones(voxels) {
            for &(number, _) in stencil.of_place(place) {
                if self.affected[number as usize] != NONE {
                    continue;
                }
                let offset = stencil.offset_of(number);
                let at: VoxelIndex = std::array::from_fn(|k| index[k] + offset[k]);
                let node = self.nodes.make(tree, at.map(|k| k >> 2), self.rules.current());
                self.affected[number as usize] = tree.make_block_in(node, place_of(at));
            }
        }
        // Most blocks are not in the cache. Reading all of them before the first write overlaps the cache misses.
        let found = self.affected.iter().filter(|block| **block != NONE);
        let inflated = found.fold(0, |any, &block| any | tree.counts.inflated(tree.blocks.get(block).tally));
        std::hint::black_box(inflated);
    }

    fn count_up(&mut self, tree: &mut Tree, id: u32, mask: u64) {
        let block = tree.blocks.get_mut(id);
        let new = tree.counts.add(&mut block.tally, mask);
        if new != 0 {
            self.inflated += new.count_ones() as usize;
            let (node, place) = (block.node, block.place);
            tree.mark_dirty(node, place);
        }
    }

    fn count_down(&mut self, tree: &mut Tree, id: u32, mask: u64) {
        let block = tree.blocks.get_mut(id);
        let ended = tree.counts.subtract(&mut block.tally, mask);
        if ended != 0 {
            self.inflated -= ended.count_ones() as usize;
            if block.tally.is_empty() {
                self.emptied.push(id);
            }
            let (node, place) = (block.node, block.place);
            tree.mark_dirty(node, place);
        }
    }

    /// Returns bytes of memory on the heap.
    pub(super) fn bytes(&self) -> usize {
        let lists = [&self.waiting, &self.emptied, &self.affected, &self.pages];
        lists.iter().map(|list| list.capacity() * size_of::<u32>()).sum::<usize>()
    }
}

/// Returns the voxels of a block that are in a ball.
fn in_ball(mask: u64, block: VoxelIndex, ball: &Ball) -> u64 {
    ones(mask).filter(|&place| ball.holds(cell_at(block, place))).fold(0, |mask, place| mask | 1 << place)
}
