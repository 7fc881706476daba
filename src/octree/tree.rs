use crate::space::MortonCode;

/// An octree of 16 levels with `f32` log-odds, always pruned and always up to date: an inner node is the maximum of
/// its children, and eight equal leaf children are one leaf.
///
/// Nodes live in blocks of eight siblings, 65 bytes a block.
#[derive(Clone, Debug, Default)]
pub struct Octree {
    root: Option<Node>,
    blocks: Vec<Block>,
    /// Which children of each block exist.
    masks: Vec<u8>,
    /// Blocks that are not in use.
    free: Vec<u32>,
    nodes: usize,
}

type Block = [Node; 8];

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Node {
    pub(super) log_odds: f32,
    /// Block of the children; [`LEAF`] for a leaf.
    pub(super) children: u32,
}

const LEAF: u32 = u32::MAX;
const FINEST_DEPTH: u8 = 16;

/// A leaf: a finest voxel, or a cube of equal ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaf {
    /// The first voxel under the leaf.
    pub code: MortonCode,
    /// Depth of the leaf: 16 for a finest voxel, one less for every doubling of the cube's edge.
    pub depth: u8,
    /// Log-odds of every voxel under the leaf.
    pub log_odds: f32,
}

impl Node {
    const NONE: Self = Self { log_odds: 0.0, children: LEAF };

    pub(super) const fn leaf(log_odds: f32) -> Self {
        Self { log_odds, children: LEAF }
    }

    pub(super) const fn is_leaf(&self) -> bool {
        self.children == LEAF
    }
}

impl Octree {
    /// An empty tree.
    pub fn new() -> Self {
        Self::default()
    }

    /// The tree of finest voxels given in ascending order.
    pub fn from_sorted(voxels: impl IntoIterator<Item = (MortonCode, f32)>) -> Self {
        let mut tree = Self::default();
        tree.write_sorted(&voxels.into_iter().collect::<Vec<_>>());
        tree
    }

    /// Overwrites finest voxels, given in ascending order; of equal codes the last counts. Voxels that lie together
    /// share their way down and up.
    pub fn write_sorted(&mut self, voxels: &[(MortonCode, f32)]) {
        if !voxels.is_empty() {
            self.nodes += usize::from(self.root.is_none());
            self.root = Some(self.written(self.root, 0, voxels));
        }
    }

    /// Overwrites one finest voxel.
    pub fn set(&mut self, code: MortonCode, log_odds: f32) {
        self.write_sorted(&[(code, log_odds)]);
    }

    /// Log-odds of the node at `depth` (0, the root, to 16, a voxel) that holds `code`, or of the leaf above it;
    /// `None` if unknown.
    pub fn get(&self, code: MortonCode, depth: u8) -> Option<f32> {
        self.node_at(code, depth).map(|node| node.log_odds)
    }

    /// What [`Octree::get`] would say of the node at `depth` that begins at `first` if the given voxels under it, in
    /// ascending order, had the given log-odds.
    pub fn max_with_overrides(
        &self,
        first: MortonCode,
        depth: u8,
        voxels: &[(MortonCode, f32)],
    ) -> Option<f32> {
        self.max_under(self.node_at(first, depth), depth, voxels)
    }

    /// Number of nodes, inner ones and the root included.
    pub fn len_nodes(&self) -> usize {
        self.nodes
    }

    /// Number of leaves.
    pub fn len_leaves(&self) -> usize {
        // Every inner node has one block.
        self.nodes - (self.blocks.len() - self.free.len())
    }

    /// Whether nothing is known.
    pub fn is_empty(&self) -> bool {
        self.root.is_none()
    }

    /// Bytes of memory on the heap.
    pub fn bytes(&self) -> usize {
        self.blocks.capacity() * size_of::<Block>()
            + self.masks.capacity()
            + self.free.capacity() * size_of::<u32>()
    }

    /// The leaves in Morton order.
    pub fn leaves(&self) -> impl Iterator<Item = Leaf> {
        let mut stack: Vec<(Node, Leaf)> = Vec::new();
        let root = |node: Node| (node, Leaf { code: MortonCode(0), depth: 0, log_odds: node.log_odds });
        stack.extend(self.root.map(root));
        std::iter::from_fn(move || {
            loop {
                let (node, place) = stack.pop()?;
                if node.is_leaf() {
                    return Some(place);
                }
                for child in (0..8).rev() {
                    if let Some(node) = self.child(node, child) {
                        let depth = place.depth + 1;
                        let code = MortonCode(place.code.0 + child as u64 * MortonCode::span(depth));
                        stack.push((node, Leaf { code, depth, log_odds: node.log_odds }));
                    }
                }
            }
        })
    }

    pub(super) fn child(&self, node: Node, child: usize) -> Option<Node> {
        let block = node.children as usize;
        (!node.is_leaf() && self.masks[block] >> child & 1 == 1).then(|| self.blocks[block][child])
    }

    pub(super) fn root(&self) -> Option<Node> {
        self.root
    }

    /// Makes a node that [`Octree::add_inner`] or a leaf gave the root; for building a tree from a file.
    pub(super) fn set_root(&mut self, root: Node) {
        self.nodes += 1;
        self.root = Some(root);
    }

    /// Adds a node above existing children, without pruning.
    pub(super) fn add_inner(&mut self, children: [Option<Node>; 8]) -> Node {
        let mask = children.iter().rev().fold(0, |mask: u8, child| mask << 1 | u8::from(child.is_some()));
        self.nodes += mask.count_ones() as usize;
        let log_odds =
            children.iter().flatten().map(|child| child.log_odds).fold(f32::NEG_INFINITY, f32::max);
        Node { log_odds, children: self.new_block(children.map(|child| child.unwrap_or(Node::NONE)), mask) }
    }

    /// Number of finest voxels that the leaves stand for, and how many of them have at least `threshold` log-odds.
    pub fn expanded_voxels(&self, threshold: f32) -> (u64, u64) {
        self.leaves().fold((0, 0), |(all, occupied), leaf| {
            let voxels = MortonCode::span(leaf.depth);
            (all + voxels, occupied + if leaf.log_odds >= threshold { voxels } else { 0 })
        })
    }

    fn node_at(&self, code: MortonCode, depth: u8) -> Option<Node> {
        let mut node = self.root?;
        for level in 0..depth.min(FINEST_DEPTH) {
            if node.is_leaf() {
                break;
            }
            node = self.child(node, code.child_at(level))?;
        }
        Some(node)
    }

    /// The node after the voxels under it are overwritten. The node itself is counted by its parent.
    fn written(&mut self, node: Option<Node>, depth: u8, voxels: &[(MortonCode, f32)]) -> Node {
        let last = voxels[voxels.len() - 1].1;
        if depth == FINEST_DEPTH {
            return Node::leaf(last);
        }
        let block = match node {
            None => self.new_block([Node::NONE; 8], 0),
            Some(leaf) if leaf.is_leaf() => {
                if voxels.iter().all(|&(_, log_odds)| log_odds.to_bits() == leaf.log_odds.to_bits()) {
                    return leaf;
                }
                self.nodes += 8;
                self.new_block([leaf; 8], 0xff)
            }
            Some(inner) => inner.children,
        } as usize;
        for group in voxels.chunk_by(|a, b| a.0.child_at(depth) == b.0.child_at(depth)) {
            let child = group[0].0.child_at(depth);
            let is_new = self.masks[block] >> child & 1 == 0;
            let before = (!is_new).then(|| self.blocks[block][child]);
            self.nodes += usize::from(is_new);
            self.masks[block] |= 1 << child;
            self.blocks[block][child] = self.written(before, depth + 1, group);
        }
        self.summary(block)
    }

    /// The node above a block: a leaf if the block holds eight equal leaves, which then goes away.
    fn summary(&mut self, block: usize) -> Node {
        let (children, mask) = (&self.blocks[block], self.masks[block]);
        let first = children[0];
        let equals_first =
            |child: &Node| child.is_leaf() && child.log_odds.to_bits() == first.log_odds.to_bits();
        if mask == 0xff && children.iter().all(equals_first) {
            self.nodes -= 8;
            self.free.push(block as u32);
            return first;
        }
        let existing = children.iter().enumerate().filter(|(child, _)| mask >> child & 1 == 1);
        let max = existing.map(|(_, child)| child.log_odds).fold(f32::NEG_INFINITY, f32::max);
        Node { log_odds: max, children: block as u32 }
    }

    fn new_block(&mut self, children: Block, mask: u8) -> u32 {
        if let Some(block) = self.free.pop() {
            self.blocks[block as usize] = children;
            self.masks[block as usize] = mask;
            return block;
        }
        self.blocks.push(children);
        self.masks.push(mask);
        (self.blocks.len() - 1) as u32
    }

    fn max_under(&self, node: Option<Node>, depth: u8, voxels: &[(MortonCode, f32)]) -> Option<f32> {
        let max_of_voxels = || voxels.iter().map(|&(_, log_odds)| log_odds).reduce(f32::max);
        let Some(node) = node else { return max_of_voxels() };
        if voxels.is_empty() {
            return Some(node.log_odds);
        }
        if node.is_leaf() {
            let covers_all = voxels.len() as u64 >= MortonCode::span(depth);
            return if covers_all {
                max_of_voxels()
            } else {
                max_of_voxels().map(|max| max.max(node.log_odds))
            };
        }
        let mut rest = voxels;
        let mut max: Option<f32> = None;
        for child in 0..8 {
            let count = rest.iter().take_while(|(code, _)| code.child_at(depth) == child).count();
            let (group, others) = rest.split_at(count);
            rest = others;
            let under = self.max_under(self.child(node, child), depth + 1, group);
            max = under.into_iter().chain(max).reduce(f32::max);
        }
        max
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// Codes in a few clusters, so that cubes fill up, and few values, so that they are equal.
    fn voxels() -> impl Strategy<Value = Vec<(u64, f32)>> {
        let code = (0..3_u64, 0..128_u64).prop_map(|(cluster, low)| cluster * 0x0123_4567_8000 + low);
        let value = prop::sample::select(vec![-1.0_f32, 0.5, 0.5, 0.5, 2.0]);
        prop::collection::vec((code, value), 0..600)
    }

    fn max_in(model: &BTreeMap<u64, f32>, code: u64, depth: u8) -> Option<f32> {
        let first = MortonCode(code).ancestor(depth).0;
        model.range(first..first + MortonCode::span(depth)).map(|(_, &value)| value).reduce(f32::max)
    }

    /// Leaves and nodes of the pruned tree of a model, counted from the definition.
    fn minimal_leaves(model: &BTreeMap<u64, f32>) -> usize {
        let is_leaf = |code: u64, depth: u8| {
            let first = MortonCode(code).ancestor(depth).0;
            let values: Vec<f32> =
                model.range(first..first + MortonCode::span(depth)).map(|(_, &v)| v).collect();
            values.len() as u64 == MortonCode::span(depth) && values.iter().all(|&v| v == values[0])
        };
        let mut leaves: Vec<(u64, u8)> = model
            .keys()
            .map(|&code| {
                let depth = (0..=16).find(|&depth| is_leaf(code, depth)).expect("depth 16 is one voxel");
                (MortonCode(code).ancestor(depth).0, depth)
            })
            .collect();
        leaves.dedup();
        leaves.len()
    }

    proptest! {
        #[test]
        fn the_tree_equals_a_map_of_voxels_at_every_depth(batches in prop::collection::vec(voxels(), 1..4)) {
            let mut tree = Octree::new();
            let mut model = BTreeMap::new();
            for batch in batches {
                let batch: BTreeMap<u64, f32> = batch.into_iter().collect();
                let sorted: Vec<_> = batch.iter().map(|(&code, &value)| (MortonCode(code), value)).collect();
                for code in model.keys().chain(batch.keys()).copied().collect::<Vec<u64>>() {
                    for depth in [0, 5, 13, 14, 15, 16] {
                        let first = MortonCode(code).ancestor(depth);
                        let span = MortonCode::span(depth);
                        let under: Vec<_> =
                            sorted.iter().copied().filter(|(c, _)| (first.0..first.0 + span).contains(&c.0)).collect();
                        let mut with = model.clone();
                        with.extend(batch.iter().map(|(&code, &value)| (code, value)));
                        prop_assert_eq!(
                            tree.max_with_overrides(first, depth, &under),
                            max_in(&with, code, depth)
                        );
                    }
                }
                tree.write_sorted(&sorted);
                model.extend(batch);
                for &code in model.keys() {
                    for depth in 0..=16 {
                        prop_assert_eq!(tree.get(MortonCode(code), depth), max_in(&model, code, depth));
                    }
                }
                prop_assert_eq!(tree.get(MortonCode(0xffff_ffff_ffff), 16), None);
                prop_assert_eq!(tree.leaves().count(), tree.len_leaves());
                prop_assert_eq!(tree.len_leaves(), minimal_leaves(&model));
                prop_assert_eq!(tree.expanded_voxels(f32::NEG_INFINITY).0, model.len() as u64);
            }
            let mut one_by_one = Octree::new();
            model.iter().for_each(|(&code, &value)| one_by_one.set(MortonCode(code), value));
            prop_assert_eq!(one_by_one.leaves().collect::<Vec<_>>(), tree.leaves().collect::<Vec<_>>());
            prop_assert_eq!(one_by_one.len_nodes(), tree.len_nodes());
        }
    }
}
