use super::block::{Arena, Block, BlockId, Node};
use super::leaves::Leaves;
use crate::space::MortonCode;
use std::fmt;

/// Depth of the voxels; the root has depth 0.
pub(super) const DEPTH: u8 = 16;

/// OctoMap's octree: 16 levels below the root, a log-odds value (`f32`) at each known node.
///
/// - The value of an inner node is the maximum of its children.
/// - Eight sibling leaves with bit-identical values are immediately pruned into their parent, and expanded again when
///   one of them changes.
/// - A voxel that was never set is unknown and has no value.
///
/// A tree [read from a file](super::read) is kept as in the file, even if it violates the first two rules. Call
/// [`Octree::normalize`] before changing it.
///
/// Values may be any `f32` except NaN, which is accepted but has no defined order for the maxima. Only the lowest 48
/// bits of a code are used.
#[derive(Clone)]
pub struct Octree {
    pub(super) root: Node,
    pub(super) arena: Arena,
    nodes: u64,
    leaves: u64,
    voxels: u64,
}

/// Number of voxels that the leaves of a tree represent, by state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VoxelCounts {
    /// Voxels with log-odds at or above the threshold.
    pub occupied: u64,
    /// Voxels with log-odds below the threshold.
    pub free: u64,
}

impl Octree {
    /// Creates an empty tree, without an allocation.
    pub fn new() -> Self {
        Self { root: Node::Unknown, arena: Arena::default(), nodes: 0, leaves: 0, voxels: 0 }
    }

    /// Creates the tree of these voxels, in linear time if the codes ascend.
    ///
    /// The result is the same as after setting them one by one.
    pub fn from_sorted(voxels: impl IntoIterator<Item = (MortonCode, f32)>) -> Self {
        const BATCH: usize = 4096;
        let mut tree = Self::new();
        let mut voxels = voxels.into_iter();
        let mut batch = Vec::new();
        loop {
            batch.clear();
            batch.extend(voxels.by_ref().take(BATCH));
            if batch.is_empty() {
                return tree;
            }
            tree.write_sorted(&batch);
        }
    }

    /// Sets the value (log-odds) of one voxel.
    pub fn set(&mut self, code: MortonCode, value: f32) {
        self.root = self.write(self.root, 0, &[(code, value)]);
    }

    /// Sets the values (log-odds) of many voxels; the last of duplicates is used.
    ///
    /// Fast for strictly ascending codes: shared paths are descended once, and each node is summarized once per batch.
    /// Other batches are written voxel by voxel.
    pub fn write_sorted(&mut self, voxels: &[(MortonCode, f32)]) {
        let Some((last, _)) = voxels.last() else { return };
        if last.0 < MortonCode::END && voxels.is_sorted_by(|a, b| a.0 < b.0) {
            self.root = self.write(self.root, 0, voxels);
        } else {
            for &(code, value) in voxels {
                self.set(code, value);
            }
        }
    }

    /// Returns the value (log-odds) of the node at `depth` (0, the root, to 16, the voxel) over the voxel `code`, or of
    /// the leaf above it; `None` if unknown.
    ///
    /// The value is the maximum of all known voxels of the node. A depth beyond 16 counts as 16.
    pub fn get(&self, code: MortonCode, depth: u8) -> Option<f32> {
        self.node_at(code, depth).0.value()
    }

    /// The leaves in Morton order.
    pub fn leaves(&self) -> Leaves<'_> {
        Leaves::under(self, MortonCode(0), 0)
    }

    /// The leaves of the node at `depth` (0 to 16) that contains the voxel `code`, in Morton order.
    ///
    /// If the node is inside a leaf, that part of the leaf is returned.
    pub fn leaves_under(&self, code: MortonCode, depth: u8) -> Leaves<'_> {
        Leaves::under(self, code, depth)
    }

    /// The leaves in Morton order, starting with the one that contains the voxel `code`, or otherwise the next.
    pub fn leaves_from(&self, code: MortonCode) -> Leaves<'_> {
        Leaves::from(self, code)
    }

    /// Number of nodes: inner ones, leaves and the root.
    pub fn node_count(&self) -> u64 {
        self.nodes
    }

    /// Number of leaves.
    pub fn leaf_count(&self) -> u64 {
        self.leaves
    }

    /// Number of voxels that the leaves represent, at most 2^48.
    ///
    /// A few bytes of a file can represent all of them: check this number before expanding the leaves of an untrusted
    /// tree.
    pub fn expanded_leaf_count(&self) -> u64 {
        self.voxels
    }

    /// Counts the voxels that the leaves represent, by a threshold (log-odds). Visits all leaves.
    pub fn count_voxels(&self, threshold_log_odds: f32) -> VoxelCounts {
        let mut counts = VoxelCounts::default();
        for leaf in self.leaves() {
            let count =
                if leaf.value >= threshold_log_odds { &mut counts.occupied } else { &mut counts.free };
            *count += MortonCode::span(leaf.depth);
        }
        counts
    }

    /// Returns whether no voxel is known.
    pub fn is_empty(&self) -> bool {
        self.nodes == 0
    }

    /// Bytes of memory on the heap, including unused ones.
    pub fn bytes(&self) -> usize {
        self.arena.bytes()
    }

    /// Removes all voxels and frees the memory.
    pub fn clear(&mut self) {
        *self = Self::new();
    }

    /// Sets each inner node to the maximum of its children and prunes all prunable nodes, as if the voxels had been set
    /// one by one.
    pub fn normalize(&mut self) {
        self.root = self.normalized(self.root);
    }

    fn normalized(&mut self, node: Node) -> Node {
        let Node::Inner { block, .. } = node else { return node };
        for index in 0..8 {
            let child = self.arena[block].child(index);
            let child = self.normalized(child);
            self.arena[block].set_child(index, child);
        }
        self.summed_up(block)
    }

    /// Writes voxels, at least one and all below `node`; returns the changed node.
    fn write(&mut self, node: Node, depth: u8, voxels: &[(MortonCode, f32)]) -> Node {
        if depth == DEPTH {
            if let Node::Unknown = node {
                self.add_leaf(depth);
            }
            return voxels.last().map_or(node, |&(_, value)| Node::Leaf(value));
        }
        let block = match node {
            Node::Inner { block, .. } => block,
            Node::Leaf(value) if voxels.iter().all(|(_, new)| new.to_bits() == value.to_bits()) => {
                return node;
            }
            Node::Leaf(value) => {
                self.nodes += 8;
                self.leaves += 7;
                self.arena.allocate(Block::of_leaves(value))
            }
            Node::Unknown => self.add_inner(),
        };
        let mut changed = false;
        for (index, run) in runs_by_child(voxels, depth) {
            let before = self.arena[block].child(index);
            let after = self.write(before, depth + 1, run);
            if !after.is_same_as(before) {
                self.arena[block].set_child(index, after);
                changed = true;
            }
        }
        if changed { self.summed_up(block) } else { node }
    }

    /// Returns the node above a block: a leaf if the block can be pruned; the block is then released.
    fn summed_up(&mut self, block: BlockId) -> Node {
        match self.arena[block].uniform_leaves() {
            Some(value) => {
                self.arena.release(block);
                self.nodes -= 8;
                self.leaves -= 7;
                Node::Leaf(value)
            }
            None => Node::Inner { value: self.arena[block].max(), block },
        }
    }

    /// Counts a new inner node, and allocates its children's block.
    pub(super) fn add_inner(&mut self) -> BlockId {
        self.nodes += 1;
        self.arena.allocate(Block::EMPTY)
    }

    pub(super) fn add_leaf(&mut self, depth: u8) {
        self.nodes += 1;
        self.leaves += 1;
        self.voxels += MortonCode::span(depth);
    }

    /// Returns the node at `depth` that contains `code`, or the leaf or unknown node above it, and the depth found.
    pub(super) fn node_at(&self, code: MortonCode, depth: u8) -> (Node, u8) {
        let mut node = self.root;
        for at in 0..depth.min(DEPTH) {
            let Node::Inner { block, .. } = node else { return (node, at) };
            node = self.arena[block].child(code.child_at(at));
        }
        (node, depth.min(DEPTH))
    }
}

/// Splits voxels in Morton order by child of their common ancestor at `depth`.
pub(super) fn runs_by_child(
    mut voxels: &[(MortonCode, f32)],
    depth: u8,
) -> impl Iterator<Item = (usize, &[(MortonCode, f32)])> {
    std::iter::from_fn(move || {
        let index = voxels.first()?.0.child_at(depth);
        // For most ancestors, all voxels of a batch are in one child.
        let run = if voxels[voxels.len() - 1].0.child_at(depth) == index {
            std::mem::take(&mut voxels)
        } else {
            let (run, rest) = voxels.split_at(voxels.partition_point(|v| v.0.child_at(depth) <= index));
            voxels = rest;
            run
        };
        Some((index, run))
    })
}

impl Default for Octree {
    fn default() -> Self {
        Self::new()
    }
}

impl fmt::Debug for Octree {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Octree")
            .field("nodes", &self.nodes)
            .field("leaves", &self.leaves)
            .finish_non_exhaustive()
    }
}
