use super::node_encoder::NodeEncoder;
use crate::space::MortonCode;
use std::io::{self, Read, Write};

/// Node whose bytes are in a spool.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block<N> {
    pub(super) first: MortonCode,
    pub(super) depth: u8,
    pub(super) node: N,
    /// Size of the node and its descendants in bytes.
    pub(super) bytes: u64,
}

/// Nodes above the blocks of a tree.
pub(super) enum Spine<E: NodeEncoder> {
    Unknown,
    /// The next block of the spool, with its size in bytes.
    Block(E::Node, u64),
    /// An inner node with its children, or a leaf into which they were pruned.
    Joined(E::Node, Box<[Self; 8]>),
}

impl<E: NodeEncoder> Spine<E> {
    /// Creates the spine of blocks in Morton order.
    pub(super) fn of(encoder: &mut E, blocks: &[Block<E::Node>]) -> Self {
        Self::below(encoder, blocks, 0)
    }

    /// Creates the node at `depth` above these blocks.
    fn below(encoder: &mut E, blocks: &[Block<E::Node>], depth: u8) -> Self {
        match blocks {
            [] => return Self::Unknown,
            [block] if block.depth == depth => return Self::Block(block.node, block.bytes),
            _ => {}
        }
        let mut rest = blocks;
        let children = std::array::from_fn(|child| {
            let end = rest.partition_point(|block| block.first.child_at(depth) <= child);
            let (here, later) = rest.split_at(end);
            rest = later;
            Self::below(encoder, here, depth + 1)
        });
        let node = encoder.join(depth, &nodes_of(&children));
        Self::Joined(node, Box::new(children))
    }

    pub(super) fn node(&self) -> E::Node {
        match self {
            Self::Unknown => E::UNKNOWN,
            Self::Block(node, _) | Self::Joined(node, _) => *node,
        }
    }

    /// Writes the nodes in preorder, the blocks from the spool.
    pub(super) fn write(&self, spool: &mut impl Read, out: &mut impl Write) -> io::Result<()> {
        match self {
            Self::Unknown => Ok(()),
            Self::Block(_, bytes) => copy(spool, *bytes, out),
            Self::Joined(node, _) if E::is_leaf(node) => {
                let mut leaf = Vec::new();
                E::append_leaf(node, &mut leaf);
                out.write_all(&leaf)?;
                copy(spool, self.spooled_bytes(), &mut io::sink())
            }
            Self::Joined(node, children) => {
                out.write_all(E::head(node, &nodes_of(children)).as_ref())?;
                children.iter().try_for_each(|child| child.write(spool, out))
            }
        }
    }

    fn spooled_bytes(&self) -> u64 {
        match self {
            Self::Unknown => 0,
            Self::Block(_, bytes) => *bytes,
            Self::Joined(_, children) => children.iter().map(Self::spooled_bytes).sum(),
        }
    }
}

fn nodes_of<E: NodeEncoder>(children: &[Spine<E>; 8]) -> [E::Node; 8] {
    std::array::from_fn(|child| children[child].node())
}

fn copy(spool: &mut impl Read, bytes: u64, out: &mut impl Write) -> io::Result<()> {
    if io::copy(&mut spool.take(bytes), out)? < bytes {
        return Err(io::Error::new(
            io::ErrorKind::UnexpectedEof,
            "the spool is shorter than the data written to it",
        ));
    }
    Ok(())
}
