use super::OctreeFormat;
use super::bt::{Code, PrunedDepths};
use super::header::write_header;
use super::node_encoder::{BRICK_DEPTH, NodeEncoder, Prunable, begin_node, encode, end_node};
use crate::octree::BrickNodes;
use crate::octree::tree::DEPTH;
use crate::space::BrickCode;
use std::io::{self, Write};

/// Writes the output of [`write_bt`](super::write_bt) for the tree of these bricks, without building the tree.
///
/// `bricks` are those with a known voxel, strictly ascending; `nodes_of` returns the nodes under the one at a position,
/// and may be called twice.
///
/// # Errors
///
/// Same errors as [`write_bt`](super::write_bt).
pub fn write_bt_of_bricks(
    bricks: &[BrickCode],
    nodes_of: impl Fn(usize) -> BrickNodes,
    resolution_m: f64,
    out: &mut impl Write,
) -> io::Result<()> {
    let mut payload = Vec::new();
    let mut encode_all = |encoder: &mut BtEncoder| {
        payload.clear();
        encode(encoder, bricks, 0..bricks.len(), 0, &mut payload, &mut |encoder, range, payload| {
            encoder.encode_brick(&nodes_of(range.start), payload)
        })
    };
    let mut encoder = BtEncoder::new(PrunedDepths::ALL);
    let mut root = encode_all(&mut encoder);
    if let Some(depths) = encoder.depths_of_octomap() {
        // OctoMap stops pruning earlier: encode again with its depths.
        root = encode_all(&mut BtEncoder::new(depths));
    }
    write_header(out, OctreeFormat::Bt, root.nodes, resolution_m)?;
    out.write_all(BtEncoder::before_root(&root))?;
    out.write_all(&payload)
}

/// Encoder of nodes in `.bt` form: two bits per child.
#[derive(Debug)]
pub(super) struct BtEncoder {
    depths: PrunedDepths,
    prunable: Prunable,
}

/// Encoded node with its descendants.
#[derive(Clone, Copy, Debug)]
pub(super) struct BtNode {
    code: Code,
    /// Value of a node that is a leaf before values are reduced to occupied and free.
    leaf: Option<f32>,
    nodes: u64,
}

impl BtEncoder {
    /// Creates an encoder that prunes to these depths.
    pub(super) fn new(depths: PrunedDepths) -> Self {
        Self { depths, prunable: [0; DEPTH as usize] }
    }

    /// Returns the depths that OctoMap would prune, if these are fewer than all.
    pub(super) fn depths_of_octomap(&self) -> Option<PrunedDepths> {
        let depths = PrunedDepths::of(&self.prunable);
        (!depths.prune_all(&self.prunable)).then_some(depths)
    }

    /// Returns the bytes before the root: if the root is a leaf, a mark that it has no children.
    pub(super) fn before_root(root: &BtNode) -> &'static [u8] {
        if matches!(root.code, Code::Free | Code::Occupied) { &[0; 2] } else { &[] }
    }

    /// Appends the bytes of a brick with a known voxel.
    pub(super) fn encode_brick(&mut self, nodes: &BrickNodes, payload: &mut Vec<u8>) -> BtNode {
        if nodes.leaf.is_some() {
            return BtNode { code: state(nodes.occupied[0]), leaf: nodes.leaf, nodes: 1 };
        }
        let begin = begin_node::<Self>(payload);
        let mut children = [Self::UNKNOWN; 8];
        for (word, child) in children.iter_mut().enumerate() {
            let (known, occupied) = (nodes.known[word], nodes.occupied[word]);
            if known == 0 {
                continue;
            }
            *child = if nodes.leaves_14 >> word & 1 == 1 {
                BtNode::leaf(state(occupied))
            } else {
                self.encode_word(known, occupied, (nodes.leaves_15 >> (8 * word)) as u8, payload)
            };
        }
        end_node(self, begin, BRICK_DEPTH, &children, payload)
    }

    /// Appends a node of 4 x 4 x 4 voxels; bit `k` of `leaves` marks its `k`-th child as a leaf.
    fn encode_word(&mut self, known: u64, occupied: u64, leaves: u8, payload: &mut Vec<u8>) -> BtNode {
        let begin = begin_node::<Self>(payload);
        let mut children = [Self::UNKNOWN; 8];
        for (byte, child) in children.iter_mut().enumerate() {
            let (known, occupied) = ((known >> (8 * byte)) as u8, (occupied >> (8 * byte)) as u8);
            if known == 0 {
                continue;
            }
            let is_leaf = leaves >> byte & 1 == 1;
            let is_prunable = !is_leaf && known == u8::MAX && (occupied == 0 || occupied == u8::MAX);
            self.prunable[usize::from(DEPTH - 1)] += u64::from(is_prunable);
            *child = if is_leaf || is_prunable && self.depths.include(DEPTH - 1) {
                BtNode::leaf(state(occupied.into()))
            } else {
                payload.extend(Code::pack_voxels(known, occupied));
                BtNode { code: Code::Inner, leaf: None, nodes: 1 + u64::from(known.count_ones()) }
            };
        }
        end_node(self, begin, DEPTH - 2, &children, payload)
    }
}

impl BtNode {
    /// Creates a leaf below the depth of bricks. It needs no value, because the masks of the brick record which values
    /// are equal.
    const fn leaf(code: Code) -> Self {
        Self { code, leaf: None, nodes: 1 }
    }
}

impl NodeEncoder for BtEncoder {
    type Node = BtNode;
    type Head = [u8; 2];
    const UNKNOWN: BtNode = BtNode { code: Code::Unknown, leaf: None, nodes: 0 };

    fn join(&mut self, depth: u8, children: &[BtNode; 8]) -> BtNode {
        let leaf = children[0].leaf.filter(|first| {
            children.iter().all(|child| child.leaf.is_some_and(|leaf| leaf.to_bits() == first.to_bits()))
        });
        if leaf.is_some() {
            return BtNode { code: children[0].code, leaf, nodes: 1 };
        }
        if let Some(code) = Code::pruned(children.map(|child| child.code)) {
            self.prunable[usize::from(depth)] += 1;
            if self.depths.include(depth) {
                return BtNode::leaf(code);
            }
        }
        let nodes = 1 + children.iter().map(|child| child.nodes).sum::<u64>();
        BtNode { code: Code::Inner, leaf: None, nodes }
    }

    fn is_leaf(node: &BtNode) -> bool {
        matches!(node.code, Code::Free | Code::Occupied)
    }

    fn node_count(node: &BtNode) -> u64 {
        node.nodes
    }

    fn head(_: &BtNode, children: &[BtNode; 8]) -> [u8; 2] {
        Code::pack(children.map(|child| child.code))
    }

    fn append_leaf(_: &BtNode, _: &mut Vec<u8>) {}
}

/// Returns the state of a leaf, which is that of its first voxel.
fn state(occupied: u64) -> Code {
    if occupied & 1 == 1 { Code::Occupied } else { Code::Free }
}
