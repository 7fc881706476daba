use super::node_encoder::{BRICK_DEPTH, NodeEncoder, begin_node, end_node};
use crate::octree::brick_values::BrickContent;
use crate::octree::node_colour::NodeColour;
use crate::octree::tree::DEPTH;
use crate::space::BRICK_VOXELS;
use std::marker::PhantomData;

/// Encoder of nodes in `.ot` form: log-odds, data of the tree's class, and a mask of the children.
pub(super) struct OtEncoder<D>(PhantomData<D>);

/// Encoded node with its descendants.
#[derive(Clone, Copy, Debug)]
pub(super) struct OtNode<D> {
    /// Negative infinity if no voxel is known.
    value: f32,
    data: D,
    is_leaf: bool,
    nodes: u64,
}

/// Data of a node in addition to its log-odds: `()` in an `OcTree`, a colour in a `ColorOcTree`.
pub(super) trait NodeData: Copy + PartialEq {
    /// Bytes of a node without its descendants.
    type Bytes: AsRef<[u8]> + Default;
    /// Data of a node without known voxels.
    const NONE: Self;

    /// Returns the data of a voxel.
    fn of_voxel(content: &BrickContent, place: usize) -> Self;

    /// Returns the data of an inner node.
    fn of_children(children: impl Iterator<Item = Self>) -> Self;

    /// Returns the bytes of a node with this mask of known children.
    fn bytes(self, value: f32, known: u8) -> Self::Bytes;
}

impl NodeData for () {
    type Bytes = [u8; 5];
    const NONE: Self = ();

    fn of_voxel(_: &BrickContent, _: usize) -> Self {}

    fn of_children(_: impl Iterator<Item = Self>) -> Self {}

    fn bytes(self, value: f32, known: u8) -> [u8; 5] {
        let [a, b, c, d] = value.to_le_bytes();
        [a, b, c, d, known]
    }
}

impl NodeData for NodeColour {
    type Bytes = [u8; 8];
    const NONE: Self = Self::NONE;

    fn of_voxel(content: &BrickContent, place: usize) -> Self {
        content.colours.get(place).copied().unwrap_or(Self::NONE)
    }

    fn of_children(children: impl Iterator<Item = Self>) -> Self {
        Self::mean(children)
    }

    fn bytes(self, value: f32, known: u8) -> [u8; 8] {
        let ([a, b, c, d], [red, green, blue]) = (value.to_le_bytes(), self.0);
        [a, b, c, d, red, green, blue, known]
    }
}

impl<D: NodeData> OtEncoder<D> {
    pub(super) fn new() -> Self {
        Self(PhantomData)
    }

    /// Appends the bytes of a brick with a known voxel.
    pub(super) fn encode_brick(&mut self, content: &BrickContent, payload: &mut Vec<u8>) -> OtNode<D> {
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
    ) -> OtNode<D> {
        let run = if span < 64 { ((1 << span) - 1) << (first % 64) } else { u64::MAX };
        let mut words = content.known[first / 64..(first + span).div_ceil(64)].iter();
        if words.all(|word| word & run == 0) {
            return Self::UNKNOWN;
        }
        if depth == DEPTH {
            let (value, data) = (content.values[first], D::of_voxel(content, first));
            let node = OtNode { value, data, is_leaf: true, nodes: 1 };
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

impl<D: NodeData> NodeEncoder for OtEncoder<D> {
    type Node = OtNode<D>;
    type Head = D::Bytes;
    const UNKNOWN: OtNode<D> = OtNode { value: f32::NEG_INFINITY, data: D::NONE, is_leaf: false, nodes: 0 };

    fn join(&mut self, _: u8, children: &[OtNode<D>; 8]) -> OtNode<D> {
        let OtNode { value: first, data, .. } = children[0];
        // OctoMap's own pruning of a `ColorOcTree` ignores colours and averages them; this keeps those of all voxels.
        let is_first = |child: &OtNode<D>| child.value.to_bits() == first.to_bits() && child.data == data;
        if children.iter().all(|child| child.is_leaf && is_first(child)) {
            return OtNode { value: first, data, is_leaf: true, nodes: 1 };
        }
        let value = children.iter().fold(f32::NEG_INFINITY, |max, child| larger(max, child.value));
        let known = children.iter().filter(|child| child.nodes > 0);
        let nodes = 1 + children.iter().map(|child| child.nodes).sum::<u64>();
        OtNode { value, data: D::of_children(known.map(|child| child.data)), is_leaf: false, nodes }
    }

    fn is_leaf(node: &OtNode<D>) -> bool {
        node.is_leaf
    }

    fn node_count(node: &OtNode<D>) -> u64 {
        node.nodes
    }

    fn head(node: &OtNode<D>, children: &[OtNode<D>; 8]) -> D::Bytes {
        let known = (0..8).filter(|&child| children[child].nodes > 0);
        node.data.bytes(node.value, known.fold(0, |mask, child| mask | 1 << child))
    }

    fn append_leaf(node: &OtNode<D>, payload: &mut Vec<u8>) {
        payload.extend_from_slice(node.data.bytes(node.value, 0).as_ref());
    }
}

/// Returns the first of equal values, as in a tree in memory: the two zeros are equal, but not bit-identical.
fn larger(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}
