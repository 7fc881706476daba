use super::Octree;
use super::block::{BlockId, Node};
use super::tree::DEPTH;
use crate::space::MortonCode;

/// Leaf: all voxels of the node have the value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaf {
    /// First voxel of the node.
    pub code: MortonCode,
    /// Depth of the node, 0 (the root) to 16 (a single voxel).
    pub depth: u8,
    /// Log-odds.
    pub value: f32,
}

/// Iterator over the leaves of a tree, or of a part of it, in Morton order; returned by [`Octree::leaves`] and similar
/// methods.
#[derive(Clone)]
pub struct Leaves<'a> {
    tree: &'a Octree,
    /// A leaf without a block, if it is the only result.
    single: Option<Leaf>,
    /// Blocks on the current path, from the outermost to the innermost.
    path: Vec<Step>,
}

#[derive(Clone)]
struct Step {
    block: BlockId,
    next_child: usize,
    /// First voxel of the node above the block.
    code: u64,
    /// Depth of the block's children.
    depth: u8,
}

impl<'a> Leaves<'a> {
    /// Returns the leaves of the node at `depth` that contains `code`.
    pub(super) fn under(tree: &'a Octree, code: MortonCode, depth: u8) -> Self {
        let depth = depth.min(DEPTH);
        let code = MortonCode(code.ancestor(depth).0 % MortonCode::END);
        let mut leaves = Self { tree, single: None, path: Vec::new() };
        match tree.node_at(code, depth).0 {
            Node::Unknown => {}
            Node::Leaf(value) => leaves.single = Some(Leaf { code, depth, value }),
            Node::Inner { block, .. } => {
                leaves.path.push(Step { block, next_child: 0, code: code.0, depth: depth + 1 });
            }
        }
        leaves
    }

    /// Returns the leaves from the one that contains `code` on, or from the next one if no leaf contains it.
    pub(super) fn from(tree: &'a Octree, code: MortonCode) -> Self {
        let mut leaves = Self::under(tree, MortonCode(0), 0);
        // Skips everything before the voxel during the descent.
        while let Some(step) = leaves.path.last_mut() {
            let child = code.child_at(step.depth - 1);
            step.next_child = child;
            let Node::Inner { block, .. } = tree.arena[step.block].child(child) else { break };
            step.next_child += 1;
            let below = Step { block, next_child: 0, code: step.code_of(child), depth: step.depth + 1 };
            leaves.path.push(below);
        }
        leaves
    }
}

impl Step {
    fn code_of(&self, child: usize) -> u64 {
        self.code + child as u64 * MortonCode::span(self.depth)
    }
}

impl Iterator for Leaves<'_> {
    type Item = Leaf;

    fn next(&mut self) -> Option<Leaf> {
        if let Some(leaf) = self.single.take() {
            return Some(leaf);
        }
        while let Some(step) = self.path.last_mut() {
            let child = step.next_child;
            if child == 8 {
                self.path.pop();
                continue;
            }
            step.next_child += 1;
            let (code, depth) = (step.code_of(child), step.depth);
            match self.tree.arena[step.block].child(child) {
                Node::Unknown => {}
                Node::Leaf(value) => return Some(Leaf { code: MortonCode(code), depth, value }),
                Node::Inner { block, .. } => {
                    self.path.push(Step { block, next_child: 0, code, depth: depth + 1 });
                }
            }
        }
        None
    }
}
