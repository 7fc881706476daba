use crate::octree::BrickNodes;

/// What an octree needs of a brick, in eight bytes; computed anew after the brick has changed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Summary {
    /// Largest log-odds.
    pub(crate) max: f32,
    /// Nodes of OctoMap's tree, including the brick's own at depth 13.
    pub(crate) nodes: u16,
    /// Whether the brick is one leaf: all 512 voxels are known and have one value.
    pub(crate) is_leaf: bool,
    /// Whether the brick has changed since.
    pub(crate) is_stale: bool,
}

impl Summary {
    pub(crate) const STALE: Self = Self { max: f32::NEG_INFINITY, nodes: 0, is_leaf: false, is_stale: true };
}

impl From<(BrickNodes, f32)> for Summary {
    fn from((nodes, max): (BrickNodes, f32)) -> Self {
        let is_leaf = nodes.leaf.is_some();
        // 585 at most.
        Self { max, nodes: nodes.node_count() as u16, is_leaf, is_stale: false }
    }
}

#[inline]
pub(crate) fn larger(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}
