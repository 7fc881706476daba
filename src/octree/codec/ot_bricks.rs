use super::node_encoder::{BRICK_DEPTH, NodeEncoder, begin_node, end_node};
use crate::octree::brick_values::BrickContent;
use crate::octree::tree::DEPTH;
use crate::space::BRICK_VOXELS;

/// Encoder of nodes in `.ot` form: log-odds, and a mask of the children.
pub(super) struct OtEncoder;

/// Encoded node with its descendants.
#[derive(Clone, Copy, Debug)]
pub(super) struct OtNode {
    /// Negative infinity if no voxel is known.
    value: f32,
    is_leaf: bool,
    nodes: u64,
}

impl OtEncoder {
    /// Appends the bytes of a brick with a known voxel.
    pub(super) fn encode_brick(&mut self, content: &BrickContent, payload: &mut Vec<u8>) -> OtNode {
        self.encode_run(content, 0, BRICK_VOXELS, BRICK_DEPTH, payload)
    }

    /// Appends the node of `span` voxels from a position on.
    fn encode_run(
        &mut self,
        content: &BrickContent,
        first: usize,
        span: usize,
        depth: u8,
        payload: &mut Vec<u8>,
    ) -> OtNode {
        let run = if span < 64 { ((1 << span) - 1) << (first % 64) } else { u64::MAX };
        let mut words = content.known[first / 64..(first + span).div_ceil(64)].iter();
        if words.all(|word| word & run == 0) {
            return Self::UNKNOWN;
        }
        if depth == DEPTH {
            let node = OtNode { value: content.values[first], is_leaf: true, nodes: 1 };
            Self::append_leaf(&node, payload);
            return node;
        }
        let begin = begin_node::<Self>(payload);
        let children = std::array::from_fn(|child| {
            self.encode_run(content, first + child * span / 8, span / 8, depth + 1, payload)
        });
        end_node(self, begin, depth, &children, payload)
    }
}

impl NodeEncoder for OtEncoder {
    type Node = OtNode;
    type Head = [u8; 5];
    const UNKNOWN: OtNode = OtNode { value: f32::NEG_INFINITY, is_leaf: false, nodes: 0 };

    fn join(&mut self, _: u8, children: &[OtNode; 8]) -> OtNode {
        let first = children[0].value;
        if children.iter().all(|child| child.is_leaf && child.value.to_bits() == first.to_bits()) {
            return OtNode { value: first, is_leaf: true, nodes: 1 };
        }
        let value = children.iter().fold(f32::NEG_INFINITY, |max, child| larger(max, child.value));
        OtNode { value, is_leaf: false, nodes: 1 + children.iter().map(|child| child.nodes).sum::<u64>() }
    }

    fn is_leaf(node: &OtNode) -> bool {
        node.is_leaf
    }

    fn node_count(node: &OtNode) -> u64 {
        node.nodes
    }

    fn head(node: &OtNode, children: &[OtNode; 8]) -> [u8; 5] {
        let known = (0..8).filter(|&child| children[child].nodes > 0);
        let [a, b, c, d] = node.value.to_le_bytes();
        [a, b, c, d, known.fold(0, |mask, child| mask | 1 << child)]
    }

    fn append_leaf(node: &OtNode, payload: &mut Vec<u8>) {
        payload.extend_from_slice(&node.value.to_le_bytes());
        payload.push(0);
    }
}

/// Returns the first of equal values, as in a tree in memory: the two zeros are equal, but not bit-identical.
fn larger(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}
