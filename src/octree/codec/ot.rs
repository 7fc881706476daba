use super::OctreeFormat;
use super::header::{Header, write_header};
use super::input::Input;
use super::octree_file::GrowingTree;
use crate::error::{DecodeError, FormatError};
use crate::octree::Octree;
use crate::octree::block::Node;
use crate::octree::tree::DEPTH;
use std::io::{self, BufRead, BufWriter, Write};

pub(super) fn read_nodes(
    input: &mut Input<impl BufRead>,
    header: &Header,
    mut growing: GrowingTree,
) -> Result<Octree, DecodeError> {
    let color_bytes = match header.id.as_str() {
        // OctoMap writes a stamped tree without its stamps.
        "OcTree" | "OcTreeStamped" => 0,
        "ColorOcTree" => 3,
        id => {
            let reason =
                format!("a tree of class {id:?} is not read; OcTree, OcTreeStamped and ColorOcTree are");
            return Err(input.error(reason).into());
        }
    };
    // The size may be missing. An empty tree has the size 0 and no nodes.
    if header.nodes > 0 || input.peek()?.is_some() {
        growing.tree.root = read_node(input, &mut growing, color_bytes, 0)?;
    }
    Ok(growing.tree)
}

fn read_node(
    input: &mut Input<impl BufRead>,
    growing: &mut GrowingTree,
    color_bytes: usize,
    depth: u8,
) -> Result<Node, DecodeError> {
    let begin = input.offset();
    let value = f32::from_le_bytes(input.take("the log-odds of a node")?);
    if !value.is_finite() {
        return Err(FormatError::at_offset(begin, format!("log-odds {value} are not finite")).into());
    }
    for _ in 0..color_bytes {
        input.take::<1>("the color of a node")?;
    }
    let mask_at = input.offset();
    let [mask] = input.take("the children of a node")?;
    if mask == 0 {
        growing.tree.add_leaf(depth);
        return Ok(Node::Leaf(value));
    }
    if depth == DEPTH {
        let reason = "a node at the finest level has children";
        return Err(FormatError::at_offset(mask_at, reason).into());
    }
    let block = growing.add_inner(input)?;
    for index in (0..8).filter(|index| mask >> index & 1 == 1) {
        let child = read_node(input, growing, color_bytes, depth + 1)?;
        growing.tree.arena[block].set_child(index, child);
    }
    Ok(Node::Inner { value, block })
}

/// Writes the `.ot` file that OctoMap's `write` would write for this tree.
///
/// # Errors
///
/// Returns errors from `out`, and [`io::ErrorKind::InvalidInput`] if the resolution is not a positive, finite length.
pub fn write_ot(tree: &Octree, resolution_m: f64, out: &mut impl Write) -> io::Result<()> {
    // Buffered, because nodes have five bytes and `out` may be a file.
    let mut out = BufWriter::new(out);
    write_header(&mut out, OctreeFormat::Ot, tree.node_count(), resolution_m)?;
    write_node(tree, tree.root, &mut out)?;
    out.flush()
}

fn write_node(tree: &Octree, node: Node, out: &mut impl Write) -> io::Result<()> {
    let Some(value) = node.value() else { return Ok(()) };
    out.write_all(&value.to_le_bytes())?;
    let Node::Inner { block, .. } = node else { return out.write_all(&[0]) };
    let block = &tree.arena[block];
    let known = block.children().enumerate().filter(|(_, child)| !matches!(child, Node::Unknown));
    out.write_all(&[known.fold(0, |mask, (index, _)| mask | 1 << index)])?;
    block.children().try_for_each(|child| write_node(tree, child, out))
}
