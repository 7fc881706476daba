use super::Octree;
use super::block::Node;
use super::tree::{DEPTH, runs_by_child};
use crate::space::MortonCode;

impl Octree {
    /// Returns the value that [`Octree::get`] would return for the node at `depth` (0 to 16) over the voxel `node` if
    /// `overrides` were written first. The tree is unchanged.
    ///
    /// `overrides` are codes, strictly ascending and below [`MortonCode::END`], each with its log-odds; those outside
    /// the node are ignored. In another order the result is unspecified. Only nodes with overrides are descended into.
    pub fn max_with_overrides(
        &self,
        node: MortonCode,
        depth: u8,
        overrides: &[(MortonCode, f32)],
    ) -> Option<f32> {
        let depth = depth.min(DEPTH);
        let first = node.ancestor(depth).0 % MortonCode::END;
        let end = first + MortonCode::span(depth);
        let inside = &overrides[overrides.partition_point(|(code, _)| code.0 < first)..];
        let inside = &inside[..inside.partition_point(|(code, _)| code.0 < end)];
        self.max_below(self.node_at(node, depth).0, depth, inside)
    }

    fn max_below(&self, node: Node, depth: u8, overrides: &[(MortonCode, f32)]) -> Option<f32> {
        let Some(highest) = overrides.iter().map(|&(_, value)| value).reduce(f32::max) else {
            return node.value();
        };
        let all_replaced = overrides.len() as u64 == MortonCode::span(depth);
        match node.value() {
            // The maximum may be in a voxel without an override.
            Some(value) if !all_replaced && highest < value => {}
            // Voxels without an override do not exceed the node's value.
            _ => return Some(highest),
        }
        let Node::Inner { block, .. } = node else { return node.value() };
        let mut overridden = runs_by_child(overrides, depth).peekable();
        let mut max = None;
        for (index, child) in self.arena[block].children().enumerate() {
            let run = overridden.next_if(|&(of, _)| of == index).map_or(&[][..], |(_, run)| run);
            max = larger(max, self.max_below(child, depth + 1, run));
        }
        max
    }
}

fn larger(a: Option<f32>, b: Option<f32>) -> Option<f32> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.max(b)),
        _ => a.or(b),
    }
}
