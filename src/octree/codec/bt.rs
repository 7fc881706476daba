use super::OctreeFormat;
use super::header::{Header, write_header};
use super::input::Input;
use super::octree_file::GrowingTree;
use crate::error::{DecodeError, FormatError};
use crate::octree::Octree;
use crate::octree::block::{Block, Node};
use crate::octree::tree::DEPTH;
use std::io::{self, BufRead, Write};

/// Log-odds of a free leaf read from `.bt`: OctoMap's lower clamp, `logit(0.1192)`, about -2.
pub const OCTOMAP_MIN_LOG_ODDS: f32 = f32::from_bits(0xc000_0075);

/// Log-odds of an occupied leaf read from `.bt`: OctoMap's upper clamp, `logit(0.971)`, about 3.5.
pub const OCTOMAP_MAX_LOG_ODDS: f32 = f32::from_bits(0x4060_b4ba);

/// Two-bit code of a child.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Code {
    Unknown,
    Free,
    Occupied,
    Inner,
}

impl Code {
    const ALL: [Self; 4] = [Self::Unknown, Self::Free, Self::Occupied, Self::Inner];

    fn of_leaf(log_odds: f32, threshold: f32) -> Self {
        if log_odds >= threshold { Self::Occupied } else { Self::Free }
    }

    /// Returns the codes of eight children from their two bytes.
    fn unpack(bytes: [u8; 2]) -> [Self; 8] {
        let bits = u16::from_le_bytes(bytes);
        std::array::from_fn(|child| Self::ALL[usize::from(bits >> (2 * child) & 3)])
    }

    pub(super) fn pack(codes: [Self; 8]) -> [u8; 2] {
        codes.iter().rev().fold(0, |bits: u16, &code| bits << 2 | code as u16).to_le_bytes()
    }

    /// Returns the two bytes of eight voxels, from the masks of known and of occupied ones.
    pub(super) fn pack_voxels(known: u8, occupied: u8) -> [u8; 2] {
        (spread(known & !occupied) | spread(occupied) << 1).to_le_bytes()
    }

    /// Returns the code of a node with these children if it can be pruned.
    pub(super) fn pruned(children: [Self; 8]) -> Option<Self> {
        let prunable = matches!(children[0], Self::Free | Self::Occupied);
        (prunable && children.iter().all(|&code| code == children[0])).then_some(children[0])
    }
}

/// Moves bit `k` to bit `2k`.
fn spread(bits: u8) -> u16 {
    let bits = u16::from(bits);
    let bits = (bits | bits << 4) & 0x0f0f;
    let bits = (bits | bits << 2) & 0x3333;
    (bits | bits << 1) & 0x5555
}

pub(super) fn read_nodes(
    input: &mut Input<impl BufRead>,
    header: &Header,
    mut growing: GrowingTree,
) -> Result<Octree, DecodeError> {
    let begin = input.offset();
    if header.nodes > 0 {
        growing.tree.root = read_node(input, &mut growing, 0)?;
    }
    if growing.tree.node_count() != header.nodes {
        let reason =
            format!("{} nodes follow, but the header says {}", growing.tree.node_count(), header.nodes);
        return Err(FormatError::at_offset(begin, reason).into());
    }
    Ok(growing.tree)
}

fn read_node(
    input: &mut Input<impl BufRead>,
    growing: &mut GrowingTree,
    depth: u8,
) -> Result<Node, DecodeError> {
    let begin = input.offset();
    let codes = Code::unpack(input.take("the children of a node")?);
    if codes == [Code::Unknown; 8] {
        if depth > 0 {
            return Err(FormatError::at_offset(begin, "an inner node has no children").into());
        }
        growing.tree.add_leaf(depth);
        return Ok(Node::Leaf(OCTOMAP_MAX_LOG_ODDS));
    }
    let block = growing.add_inner(input)?;
    for (index, code) in codes.into_iter().enumerate() {
        let child = match code {
            Code::Unknown => continue,
            Code::Free => Node::Leaf(OCTOMAP_MIN_LOG_ODDS),
            Code::Occupied => Node::Leaf(OCTOMAP_MAX_LOG_ODDS),
            Code::Inner if depth + 1 == DEPTH => {
                let reason = "a node at the finest level has children";
                return Err(FormatError::at_offset(begin, reason).into());
            }
            Code::Inner => read_node(input, growing, depth + 1)?,
        };
        if code != Code::Inner {
            growing.tree.add_leaf(depth + 1);
        }
        growing.tree.arena[block].set_child(index, child);
    }
    Ok(Node::Inner { value: growing.tree.arena[block].max(), block })
}

/// Writes the `.bt` file that OctoMap's `writeBinary` would write for this tree, without changing the tree.
///
/// A leaf is occupied at or above `threshold_log_odds`, otherwise free; nodes that become equal by this are pruned in
/// the file. This takes two bytes of memory for each remaining inner node.
///
/// # Errors
///
/// Returns errors from `out`, and [`io::ErrorKind::InvalidInput`] if the resolution is not a positive, finite length.
pub fn write_bt(
    tree: &Octree,
    resolution_m: f64,
    threshold_log_odds: f32,
    out: &mut impl Write,
) -> io::Result<()> {
    let mut prunable = [0; DEPTH as usize];
    count_prunable(tree, tree.root, 0, threshold_log_odds, &mut prunable);
    let depths = PrunedDepths::of(&prunable);
    write_encoded(tree, resolution_m, threshold_log_odds, depths, out)
}

/// Writes the `.bt` file that OctoMap's `writeBinaryConst` would write for this tree: as [`write_bt`], but without
/// further pruning.
///
/// # Errors
///
/// Same errors as [`write_bt`].
pub fn write_bt_unpruned(
    tree: &Octree,
    resolution_m: f64,
    threshold_log_odds: f32,
    out: &mut impl Write,
) -> io::Result<()> {
    write_encoded(tree, resolution_m, threshold_log_odds, PrunedDepths::NONE, out)
}

fn write_encoded(
    tree: &Octree,
    resolution_m: f64,
    threshold: f32,
    depths: PrunedDepths,
    out: &mut impl Write,
) -> io::Result<()> {
    let mut encoder = Encoder { tree, threshold, depths, payload: Vec::new() };
    let (root, nodes) = encoder.encode(tree.root, 0);
    if matches!(root, Code::Free | Code::Occupied) {
        encoder.payload.extend(Code::pack([Code::Unknown; 8]));
    }
    write_header(out, OctreeFormat::Bt, nodes, resolution_m)?;
    out.write_all(&encoder.payload)
}

/// Smallest depth at which nodes are pruned if possible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PrunedDepths(u8);

impl PrunedDepths {
    const NONE: Self = Self(DEPTH);
    /// All depths except that of the root, which is never pruned.
    pub(super) const ALL: Self = Self(1);

    /// Returns the depths that OctoMap's `prune` reaches: from the depth above the voxels upward, to the first depth
    /// without a prunable node. `prunable` has the number of prunable nodes by depth, if all nodes below them are
    /// pruned.
    pub(super) fn of(prunable: &[u64; DEPTH as usize]) -> Self {
        let lowest = (1..DEPTH).rev().take_while(|&depth| prunable[usize::from(depth)] > 0).last();
        lowest.map_or(Self::NONE, Self)
    }

    /// Returns whether nodes at a depth are pruned.
    pub(super) fn include(self, depth: u8) -> bool {
        depth >= self.0
    }

    /// Returns whether all prunable nodes below the root are pruned.
    pub(super) fn prune_all(self, prunable: &[u64; DEPTH as usize]) -> bool {
        prunable[1..usize::from(self.0)].iter().all(|&count| count == 0)
    }
}

/// Counts the nodes by depth that can be pruned if all nodes below them are pruned. Returns the code of `node`.
fn count_prunable(
    tree: &Octree,
    node: Node,
    depth: u8,
    threshold: f32,
    prunable: &mut [u64; DEPTH as usize],
) -> Code {
    let block = match node {
        Node::Unknown => return Code::Unknown,
        Node::Leaf(value) => return Code::of_leaf(value, threshold),
        Node::Inner { block, .. } => block,
    };
    let block: &Block = &tree.arena[block];
    let children =
        std::array::from_fn(|i| count_prunable(tree, block.child(i), depth + 1, threshold, prunable));
    let pruned = Code::pruned(children);
    prunable[usize::from(depth)] += u64::from(pruned.is_some());
    pruned.unwrap_or(Code::Inner)
}

struct Encoder<'a> {
    tree: &'a Octree,
    threshold: f32,
    depths: PrunedDepths,
    payload: Vec<u8>,
}

impl Encoder<'_> {
    /// Appends the bytes of a node and its descendants; returns its code and the number of nodes.
    fn encode(&mut self, node: Node, depth: u8) -> (Code, u64) {
        let block = match node {
            Node::Unknown => return (Code::Unknown, 0),
            Node::Leaf(value) => return (Code::of_leaf(value, self.threshold), 1),
            Node::Inner { block, .. } => block,
        };
        let begin = self.payload.len();
        self.payload.extend([0; 2]);
        let mut codes = [Code::Unknown; 8];
        let mut nodes = 1;
        for (index, child) in self.tree.arena[block].children().enumerate() {
            let (code, below) = self.encode(child, depth + 1);
            codes[index] = code;
            nodes += below;
        }
        if self.depths.include(depth)
            && let Some(pruned) = Code::pruned(codes)
        {
            self.payload.truncate(begin);
            return (pruned, 1);
        }
        self.payload[begin..begin + 2].copy_from_slice(&Code::pack(codes));
        (Code::Inner, nodes)
    }
}
