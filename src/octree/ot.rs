use super::header::{Counted, OT_MAGIC, write_header};
use super::tree::{Node, Octree};
use crate::error::{DecodeError, FormatError};
use std::io::{self, BufRead, Write};

/// Writes the tree as OctoMap's `write` does: every node with its log-odds.
pub fn write_ot(tree: &Octree, resolution_m: f64, out: &mut impl Write) -> io::Result<()> {
    write_header(OT_MAGIC, "OcTree", tree.len_nodes(), resolution_m, out)?;
    match tree.root() {
        Some(root) => write_node(tree, root, out),
        None => Ok(()),
    }
}

fn write_node(tree: &Octree, node: Node, out: &mut impl Write) -> io::Result<()> {
    let children: [Option<Node>; 8] = std::array::from_fn(|child| tree.child(node, child));
    let mask = children.iter().rev().fold(0, |mask: u8, child| mask << 1 | u8::from(child.is_some()));
    out.write_all(&node.log_odds.to_le_bytes())?;
    out.write_all(&[mask])?;
    children.into_iter().flatten().try_for_each(|child| write_node(tree, child, out))
}

/// Reads the payload of an `.ot` file, as it stands: what the file did not prune stays unpruned.
pub(super) fn read_payload<R: BufRead>(
    input: &mut Counted<R>,
    has_color: bool,
) -> Result<Octree, DecodeError> {
    let mut tree = Octree::new();
    let root = read_node(input, &mut tree, has_color, 0)?;
    tree.set_root(root);
    Ok(tree)
}

fn read_node<R: BufRead>(
    input: &mut Counted<R>,
    tree: &mut Octree,
    has_color: bool,
    depth: u8,
) -> Result<Node, DecodeError> {
    let at = input.offset;
    let log_odds = f32::from_le_bytes(input.bytes("the log-odds of a node")?);
    if !log_odds.is_finite() {
        return Err(FormatError::at_offset(at, format!("log-odds {log_odds} are not finite")).into());
    }
    if has_color {
        input.bytes::<3>("the color of a node")?;
    }
    let at = input.offset;
    let [mask] = input.bytes("the mask of a node's children")?;
    if mask == 0 {
        return Ok(Node::leaf(log_odds));
    }
    if depth == 16 {
        return Err(FormatError::at_offset(at, "a node at the finest depth of 16 with children").into());
    }
    let mut children = [None; 8];
    for (child, node) in children.iter_mut().enumerate() {
        if mask >> child & 1 == 1 {
            *node = Some(read_node(input, tree, has_color, depth + 1)?);
        }
    }
    Ok(Node { log_odds, ..tree.add_inner(children) })
}
