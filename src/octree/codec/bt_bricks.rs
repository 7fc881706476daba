use super::OctreeFormat;
use super::bt::{Code, PrunedDepths};
use super::header::write_header;
use crate::octree::BrickNodes;
use crate::octree::tree::DEPTH;
use crate::space::BrickCode;
use std::io::{self, Write};
use std::ops::Range;

/// Depth of a brick's node.
const BRICK_DEPTH: u8 = 13;

/// Writes what [`write_bt`](super::write_bt) writes for the tree of these bricks, without the tree.
///
/// `bricks` are those that hold a known voxel, strictly ascending; `nodes_of` gives what is under the one at a
/// position, and may be asked twice.
///
/// # Errors
///
/// Those of [`write_bt`](super::write_bt).
pub fn write_bt_of_bricks(
    bricks: &[BrickCode],
    nodes_of: impl Fn(usize) -> BrickNodes,
    resolution_m: f64,
    out: &mut impl Write,
) -> io::Result<()> {
    let mut encoder = Encoder {
        bricks,
        nodes_of,
        depths: PrunedDepths::ALL,
        prunable: [0; DEPTH as usize],
        payload: Vec::new(),
    };
    let mut root = encoder.encode(0..bricks.len(), 0);
    let depths = PrunedDepths::of(&encoder.prunable);
    if !depths.prune_all(&encoder.prunable) {
        // OctoMap stops earlier: once more, as far as it gets.
        encoder.depths = depths;
        encoder.payload.clear();
        root = encoder.encode(0..bricks.len(), 0);
    }
    if matches!(root.code, Code::Free | Code::Occupied) {
        encoder.payload.extend(Code::pack([Code::Unknown; 8]));
    }
    write_header(out, OctreeFormat::Bt, root.nodes, resolution_m)?;
    out.write_all(&encoder.payload)
}

struct Encoder<'a, F> {
    /// In Morton order.
    bricks: &'a [BrickCode],
    nodes_of: F,
    depths: PrunedDepths,
    /// By depth, the nodes that could be pruned once all below them were.
    prunable: [u64; DEPTH as usize],
    payload: Vec<u8>,
}

/// A node that was written, with those below it.
#[derive(Clone, Copy)]
struct Written {
    code: Code,
    /// The value of a node that is a leaf before states take the place of values.
    leaf: Option<f32>,
    nodes: u64,
}

impl Written {
    const UNKNOWN: Self = Self { code: Code::Unknown, leaf: None, nodes: 0 };
}

impl<F: Fn(usize) -> BrickNodes> Encoder<'_, F> {
    /// Appends the bytes of the node at `depth` that has these bricks below it.
    fn encode(&mut self, range: Range<usize>, depth: u8) -> Written {
        if range.is_empty() {
            return Written::UNKNOWN;
        }
        if depth == BRICK_DEPTH {
            let nodes = (self.nodes_of)(range.start);
            return self.encode_brick(&nodes);
        }
        let begin = self.begin_node();
        let mut children = [Written::UNKNOWN; 8];
        let mut start = range.start;
        while start < range.end {
            let child = child_at(self.bricks[start], depth);
            // Most ancestors have all their bricks in one child.
            let end = if child_at(self.bricks[range.end - 1], depth) == child {
                range.end
            } else {
                let rest = &self.bricks[start..range.end];
                start + rest.partition_point(|&brick| child_at(brick, depth) <= child)
            };
            children[child] = self.encode(start..end, depth + 1);
            start = end;
        }
        let nodes = 1 + children.iter().map(|child| child.nodes).sum::<u64>();
        let leaf = children[0].leaf.filter(|first| {
            children.iter().all(|child| child.leaf.is_some_and(|leaf| leaf.to_bits() == first.to_bits()))
        });
        if leaf.is_some() {
            self.payload.truncate(begin);
            return Written { code: children[0].code, leaf, nodes: 1 };
        }
        self.end_node(begin, depth, children.map(|child| child.code), nodes)
    }

    fn encode_brick(&mut self, nodes: &BrickNodes) -> Written {
        if nodes.leaf.is_some() {
            return Written { code: state(nodes.occupied[0]), leaf: nodes.leaf, nodes: 1 };
        }
        let begin = self.begin_node();
        let mut codes = [Code::Unknown; 8];
        let mut count = 1;
        for (word, code) in codes.iter_mut().enumerate() {
            let (known, occupied) = (nodes.known[word], nodes.occupied[word]);
            if known == 0 {
                continue;
            }
            let written = if nodes.leaves_14 >> word & 1 == 1 {
                Written { code: state(occupied), leaf: None, nodes: 1 }
            } else {
                self.encode_word(known, occupied, (nodes.leaves_15 >> (8 * word)) as u8)
            };
            *code = written.code;
            count += written.nodes;
        }
        self.end_node(begin, BRICK_DEPTH, codes, count)
    }

    /// A node of 4 x 4 x 4 voxels; bit `k` of `leaves` tells whether its `k`-th child is a leaf.
    fn encode_word(&mut self, known: u64, occupied: u64, leaves: u8) -> Written {
        let begin = self.begin_node();
        let mut codes = [Code::Unknown; 8];
        let mut count = 1;
        for (byte, code) in codes.iter_mut().enumerate() {
            let (known, occupied) = ((known >> (8 * byte)) as u8, (occupied >> (8 * byte)) as u8);
            if known == 0 {
                continue;
            }
            let is_leaf = leaves >> byte & 1 == 1;
            let is_prunable = !is_leaf && known == u8::MAX && (occupied == 0 || occupied == u8::MAX);
            self.prunable[usize::from(DEPTH - 1)] += u64::from(is_prunable);
            count += 1;
            if is_leaf || is_prunable && self.depths.include(DEPTH - 1) {
                *code = state(occupied.into());
            } else {
                *code = Code::Inner;
                self.payload.extend(Code::pack_voxels(known, occupied));
                count += u64::from(known.count_ones());
            }
        }
        self.end_node(begin, DEPTH - 2, codes, count)
    }

    /// Leaves room for a node's two bytes, and tells where.
    fn begin_node(&mut self) -> usize {
        let begin = self.payload.len();
        self.payload.extend([0; 2]);
        begin
    }

    /// Writes a node's two bytes, or takes back all that it wrote if it is pruned.
    fn end_node(&mut self, begin: usize, depth: u8, codes: [Code; 8], nodes: u64) -> Written {
        if let Some(code) = Code::pruned(codes) {
            self.prunable[usize::from(depth)] += 1;
            if self.depths.include(depth) {
                self.payload.truncate(begin);
                return Written { code, leaf: None, nodes: 1 };
            }
        }
        self.payload[begin..begin + 2].copy_from_slice(&Code::pack(codes));
        Written { code: Code::Inner, leaf: None, nodes }
    }
}

/// The state of a leaf from the state of its first voxel.
fn state(occupied: u64) -> Code {
    if occupied & 1 == 1 { Code::Occupied } else { Code::Free }
}

/// Which child of its ancestor at `depth` leads to a brick.
fn child_at(brick: BrickCode, depth: u8) -> usize {
    (brick.0 >> (3 * (BRICK_DEPTH - 1 - depth)) & 7) as usize
}
