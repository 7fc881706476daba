use super::header::{BT_MAGIC, Counted, write_header};
use super::tree::{Node, Octree};
use super::{BT_FREE, BT_OCCUPIED};
use crate::error::{DecodeError, FormatError};
use std::io::{self, BufRead, Write};

/// Two bits a child.
const UNKNOWN: u16 = 0;
const FREE: u16 = 1;
const OCCUPIED: u16 = 2;
const INNER: u16 = 3;

/// Writes the tree as OctoMap's `writeBinary` does: every leaf free or occupied (from `threshold` log-odds on), the
/// result pruned. The tree itself stays as it is.
pub fn write_bt(tree: &Octree, resolution_m: f64, threshold: f32, out: &mut impl Write) -> io::Result<()> {
    let mut payload = Payload { tree, threshold, bytes: Vec::new(), nodes: 0 };
    if let Some(root) = tree.root() {
        payload.nodes = 1;
        if payload.write(root) != INNER {
            // A root without children: all unknown, two bytes.
            payload.bytes.extend_from_slice(&[0, 0]);
        }
    }
    write_header(BT_MAGIC, "OcTree", payload.nodes, resolution_m, out)?;
    out.write_all(&payload.bytes)
}

struct Payload<'a> {
    tree: &'a Octree,
    threshold: f32,
    bytes: Vec<u8>,
    nodes: usize,
}

impl Payload<'_> {
    /// Appends what stands for a node and returns its code. A node that turns out to be a leaf leaves nothing.
    fn write(&mut self, node: Node) -> u16 {
        if node.is_leaf() {
            return if node.log_odds >= self.threshold { OCCUPIED } else { FREE };
        }
        let (start, nodes_before) = (self.bytes.len(), self.nodes);
        self.bytes.extend_from_slice(&[0, 0]);
        let mut codes = [UNKNOWN; 8];
        for (child, code) in codes.iter_mut().enumerate() {
            if let Some(child) = self.tree.child(node, child) {
                self.nodes += 1;
                *code = self.write(child);
            }
        }
        if (codes[0] == FREE || codes[0] == OCCUPIED) && codes.iter().all(|&code| code == codes[0]) {
            self.bytes.truncate(start);
            self.nodes = nodes_before;
            return codes[0];
        }
        let word = codes.iter().rev().fold(0, |word, &code| word << 2 | code);
        self.bytes[start..start + 2].copy_from_slice(&word.to_le_bytes());
        INNER
    }
}

/// Reads the payload of a `.bt` file, as it stands: what the file did not prune stays unpruned.
pub(super) fn read_payload<R: BufRead>(input: &mut Counted<R>) -> Result<Octree, DecodeError> {
    let mut tree = Octree::new();
    let root = match read_node(input, &mut tree, 0)? {
        // A root without children, which OctoMap reads as occupied.
        None => Node::leaf(0.0),
        Some(root) => root,
    };
    tree.set_root(root);
    Ok(tree)
}

/// Reads a node with its children; `None` if it has none.
fn read_node<R: BufRead>(
    input: &mut Counted<R>,
    tree: &mut Octree,
    depth: u8,
) -> Result<Option<Node>, DecodeError> {
    let at = input.offset;
    if depth == 16 {
        return Err(FormatError::at_offset(at, "a node below the finest depth of 16").into());
    }
    let word = u16::from_le_bytes(input.bytes("the codes of a node's children")?);
    let mut children = [None; 8];
    for (child, node) in children.iter_mut().enumerate() {
        *node = match word >> (2 * child) & 3 {
            UNKNOWN => None,
            FREE => Some(Node::leaf(BT_FREE)),
            OCCUPIED => Some(Node::leaf(BT_OCCUPIED)),
            _ => {
                let at = input.offset;
                let inner = read_node(input, tree, depth + 1)?;
                Some(inner.ok_or_else(|| FormatError::at_offset(at, "a node that has children has none"))?)
            }
        };
    }
    Ok((word != 0).then(|| tree.add_inner(children)))
}
