use crate::octree::tree::DEPTH;
use crate::space::BrickCode;
use std::ops::Range;

/// Depth of a brick's node.
pub(super) const BRICK_DEPTH: u8 = 13;

/// Encodes nodes in one of OctoMap's formats: in preorder, each inner node as a head of fixed length.
pub(super) trait NodeEncoder {
    /// What the parent and the header need of an encoded node.
    type Node: Copy;
    /// The bytes of an inner node itself.
    type Head: AsRef<[u8]> + Default;
    /// A node without known voxels.
    const UNKNOWN: Self::Node;

    /// A node with these children, one of which is known: an inner node, or a leaf if it is pruned.
    fn join(&mut self, depth: u8, children: &[Self::Node; 8]) -> Self::Node;

    /// Whether a known node is a leaf.
    fn is_leaf(node: &Self::Node) -> bool;

    /// The node itself and all nodes below it.
    fn node_count(node: &Self::Node) -> u64;

    /// The bytes of an inner node itself.
    fn head(node: &Self::Node, children: &[Self::Node; 8]) -> Self::Head;

    /// Appends the bytes that a leaf has of its own, if any.
    fn append_leaf(node: &Self::Node, payload: &mut Vec<u8>);
}

/// By depth, the number of nodes that could be pruned once all below them were.
pub(super) type Prunable = [u64; DEPTH as usize];

/// Appends the bytes of the node at `depth` (at most that of a brick) over these ascending `bricks`; `encode_brick`
/// encodes the parts of one brick.
pub(super) fn encode<E: NodeEncoder>(
    encoder: &mut E,
    bricks: &[BrickCode],
    range: Range<usize>,
    depth: u8,
    payload: &mut Vec<u8>,
    encode_brick: &mut impl FnMut(&mut E, Range<usize>, &mut Vec<u8>) -> E::Node,
) -> E::Node {
    if range.is_empty() {
        return E::UNKNOWN;
    }
    if depth == BRICK_DEPTH {
        return encode_brick(encoder, range, payload);
    }
    let begin = begin_node::<E>(payload);
    let mut children = [E::UNKNOWN; 8];
    let mut start = range.start;
    while start < range.end {
        let child = child_at(bricks[start], depth);
        // Most ancestors have all their bricks in one child.
        let end = if child_at(bricks[range.end - 1], depth) == child {
            range.end
        } else {
            let rest = &bricks[start..range.end];
            start + rest.partition_point(|&brick| child_at(brick, depth) <= child)
        };
        children[child] = encode(encoder, bricks, start..end, depth + 1, payload, encode_brick);
        start = end;
    }
    end_node(encoder, begin, depth, &children, payload)
}

/// Reserves room for an inner node's head; returns its position.
pub(super) fn begin_node<E: NodeEncoder>(payload: &mut Vec<u8>) -> usize {
    let begin = payload.len();
    payload.extend_from_slice(E::Head::default().as_ref());
    begin
}

/// Writes a node's head, or removes all that was written of the node if it is pruned.
pub(super) fn end_node<E: NodeEncoder>(
    encoder: &mut E,
    begin: usize,
    depth: u8,
    children: &[E::Node; 8],
    payload: &mut Vec<u8>,
) -> E::Node {
    let node = encoder.join(depth, children);
    if E::is_leaf(&node) {
        payload.truncate(begin);
        E::append_leaf(&node, payload);
    } else {
        let head = E::head(&node, children);
        payload[begin..begin + head.as_ref().len()].copy_from_slice(head.as_ref());
    }
    node
}

/// Which child of its ancestor at `depth` leads to a brick.
pub(super) fn child_at(brick: BrickCode, depth: u8) -> usize {
    (brick.0 >> (3 * (BRICK_DEPTH - 1 - depth)) & 7) as usize
}
