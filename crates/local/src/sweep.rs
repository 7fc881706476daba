use super::map::{LocalMap, is_known_free};
use super::parameters::LocalParameters;
use super::report::LocalReport;
use super::tree::Tree;
use voxtile::space::{Point, VoxelIndex};

/// Nodes to which changed parameters must still be applied, the nearest to the sensor last.
#[derive(Debug, Default)]
pub(super) struct Sweep {
    /// Indices of the nodes.
    nodes: Vec<VoxelIndex>,
}

impl Sweep {
    pub(super) fn is_done(&self) -> bool {
        self.nodes.is_empty()
    }

    pub(super) fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<VoxelIndex>()
    }

    /// Returns all nodes sorted by their distance to a voxel.
    fn of(tree: &Tree, from: VoxelIndex) -> Self {
        let from = from.map(|k| i64::from(k >> 4));
        let distance = |index: &VoxelIndex| {
            (0..3).map(|k| (i64::from(index[k]) - from[k]).unsigned_abs().pow(2)).fold(0, u64::saturating_add)
        };
        let nodes = tree.page_ids().flat_map(|page| tree.nodes_of(page));
        let mut nodes: Vec<VoxelIndex> = nodes.map(|&node| tree.node_index(node)).collect();
        nodes.sort_unstable_by_key(|index| (std::cmp::Reverse(distance(index)), *index));
        Self { nodes }
    }
}

impl LocalMap {
    /// Starts a sweep over all voxels if the changed parameters require it.
    pub(super) fn begin_sweep(&mut self, before: &LocalParameters) {
        let LocalParameters { inflation_range_m, inflation_radius_m, .. } = self.applied;
        let states = |p: &LocalParameters| {
            [p.log_odds.min, p.log_odds.max, p.occupied_log_odds, p.free_log_odds].map(f64::to_bits)
        };
        let inflation = |p: &LocalParameters| [p.inflation_range_m, p.inflation_radius_m].map(f64::to_bits);
        let inflates_anew = inflation(before) != inflation(&self.applied);
        if states(before) == states(&self.applied) && !inflates_anew {
            return;
        }
        if inflates_anew {
            let resolution_m = self.resolution_m();
            self.inflation.rules.set(inflation_range_m, inflation_radius_m, resolution_m);
        }
        let from = self.position.and_then(|position: Point| self.grid.voxel_of(position)).unwrap_or_default();
        self.sweep = Sweep::of(&self.tree, from);
        if self.sweep.is_done() {
            self.inflation.rules.forget_old();
        }
    }

    /// Continues the sweep for about `most` voxels, at least one node.
    pub(super) fn sweep_some(&mut self, most: usize, report: &mut LocalReport) {
        if self.sweep.is_done() {
            return;
        }
        let mut done = 0;
        while done < most
            && let Some(index) = self.sweep.nodes.pop()
        {
            done += 1;
            if let Some(node) = self.tree.node_at(index) {
                done += self.sweep_node(node, report);
            }
        }
        if self.sweep.is_done() {
            self.inflation.rules.forget_old();
            self.sweep = Sweep::default();
        }
    }

    /// Reclassifies the voxels of a node and assigns the current inflation rule; returns the work in voxels.
    fn sweep_node(&mut self, node: u32, report: &mut LocalReport) -> usize {
        let LocalParameters { log_odds, occupied_log_odds, .. } = self.applied;
        let mut work = 0;
        for block in self.tree.blocks_of(node).to_vec() {
            let voxels = self.tree.blocks.get(block).voxels.ids(&self.tree.lists).to_vec();
            work += voxels.len();
            for id in voxels {
                let voxel = self.voxels.slab.get_mut(id);
                voxel.log_odds = voxel.log_odds.clamp(log_odds.min, log_odds.max);
                let place = voxel.home().1;
                let is_occupied = voxel.log_odds >= occupied_log_odds;
                if is_known_free(&self.applied, voxel.log_odds) {
                    self.voxels.unlink(id);
                    self.remove(id);
                    report.freed += 1;
                } else if self.tree.set_occupied(block, place, is_occupied) {
                    self.inflation.wait(&mut self.tree, block);
                }
            }
        }
        let before = self.inflation.changes;
        self.inflation.adopt(&mut self.tree, node);
        // Counted twice: voxels that have stopped inflating will start again with the new stencil.
        work + 2 * (self.inflation.changes - before)
    }
}
