use crate::octree::tree::DEPTH;
use crate::space::BrickCode;
use std::ops::Range;

/// Depth of a brick's node.
pub(super) const BRICK_DEPTH: u8 = 13;

/// Encoder of nodes in one of OctoMap's formats: in preorder, each inner node as a head of fixed size.
pub(super) trait NodeEncoder {
    /// Data of an encoded node that its parent and the header need.
    type Node: Copy;
    /// Bytes of an inner node without its descendants.
    type Head: AsRef<[u8]> + Default;
    /// Node without known voxels.
    const UNKNOWN: Self::Node;

    /// Creates a node with these children, at least one of which is known: an inner node, or a leaf if it is pruned.
    fn join(&mut self, depth: u8, children: &[Self::Node; 8]) -> Self::Node;

    /// Returns whether a known node is a leaf.
    fn is_leaf(node: &Self::Node) -> bool;

    /// Number of nodes, including the node and all its descendants.
    fn node_count(node: &Self::Node) -> u64;

    /// Returns the bytes of an inner node without its descendants.
    fn head(node: &Self::Node, children: &[Self::Node; 8]) -> Self::Head;

    /// Appends the bytes of a leaf, if it has any.
    fn append_leaf(node: &Self::Node, payload: &mut Vec<u8>);
}

/// Number of nodes by depth that can be pruned if all nodes below them are pruned.
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
        // For most ancestors, all bricks are in one child.
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

/// Reserves space for an inner node's head; returns its position.
pub(super) fn begin_node<E: NodeEncoder>(payload: &mut Vec<u8>) -> usize {
    let begin = payload.len();
    payload.extend_from_slice(E::Head::default().as_ref());
    begin
}

/// Writes a node's head, or removes all bytes of the node if it is pruned.
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

/// Returns the child index of a brick's ancestor below `depth`.
pub(super) fn child_at(brick: BrickCode, depth: u8) -> usize {
    (brick.0 >> (3 * (BRICK_DEPTH - 1 - depth)) & 7) as usize
}
