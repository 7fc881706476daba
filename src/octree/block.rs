/// Node as stored in its parent, or in the tree for the root.
#[derive(Clone, Copy, Debug)]
pub(super) enum Node {
    /// No voxel below is known.
    Unknown,
    /// All voxels below have this value.
    Leaf(f32),
    /// The voxels below differ or are partially unknown; the value is the maximum of the children.
    Inner { value: f32, block: BlockId },
}

impl Node {
    pub(super) fn value(self) -> Option<f32> {
        match self {
            Self::Unknown => None,
            Self::Leaf(value) | Self::Inner { value, .. } => Some(value),
        }
    }

    /// Returns whether both are bit-identical, so that replacing one by the other does not affect ancestors.
    pub(super) fn is_same_as(self, other: Self) -> bool {
        match (self, other) {
            (Self::Unknown, Self::Unknown) => true,
            (Self::Leaf(a), Self::Leaf(b)) => a.to_bits() == b.to_bits(),
            (Self::Inner { value: a, block: p }, Self::Inner { value: b, block: q }) => {
                a.to_bits() == b.to_bits() && p == q
            }
            _ => false,
        }
    }
}

/// Index of a block in its arena.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct BlockId(u32);

/// Link of a child that does not exist.
const UNKNOWN: u32 = u32::MAX;
/// Link of a child that is a leaf.
const LEAF: u32 = u32::MAX - 1;

/// The eight children of an inner node: 64 bytes, one cache line.
#[derive(Clone)]
#[repr(align(64))]
pub(super) struct Block {
    /// Negative infinity for missing children, so that the maximum needs no mask.
    values: [f32; 8],
    /// Block of each child's own children, or [`UNKNOWN`] or [`LEAF`].
    links: [u32; 8],
}

impl Block {
    pub(super) const SIZE: usize = size_of::<Self>();

    pub(super) const EMPTY: Self = Self { values: [f32::NEG_INFINITY; 8], links: [UNKNOWN; 8] };

    /// Creates eight leaves with one value: an expanded leaf.
    pub(super) fn of_leaves(value: f32) -> Self {
        Self { values: [value; 8], links: [LEAF; 8] }
    }

    pub(super) fn child(&self, index: usize) -> Node {
        let value = self.values[index];
        match self.links[index] {
            UNKNOWN => Node::Unknown,
            LEAF => Node::Leaf(value),
            block => Node::Inner { value, block: BlockId(block) },
        }
    }

    pub(super) fn set_child(&mut self, index: usize, child: Node) {
        (self.values[index], self.links[index]) = match child {
            Node::Unknown => (f32::NEG_INFINITY, UNKNOWN),
            Node::Leaf(value) => (value, LEAF),
            Node::Inner { value, block } => (value, block.0),
        };
    }

    /// The children in index order.
    pub(super) fn children(&self) -> impl Iterator<Item = Node> {
        (0..8).map(|index| self.child(index))
    }

    /// Largest value of the children.
    pub(super) fn max(&self) -> f32 {
        let [a, b, c, d, e, f, g, h] = self.values;
        // In pairs, so that each comparison waits for fewer earlier ones.
        larger(larger(larger(a, b), larger(c, d)), larger(larger(e, f), larger(g, h)))
    }

    /// The value of all eight children, if they are leaves with bit-identical values.
    pub(super) fn uniform_leaves(&self) -> Option<f32> {
        let bits = self.values[0].to_bits();
        let uniform =
            self.links.iter().all(|&link| link == LEAF) && self.values.iter().all(|v| v.to_bits() == bits);
        uniform.then_some(self.values[0])
    }
}

fn larger(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

/// All blocks of a tree in one allocation; released blocks form a free list.
#[derive(Clone)]
pub(super) struct Arena {
    blocks: Vec<Block>,
    /// Head of the free list; the next block is in `links[0]`, [`UNKNOWN`] ends the list.
    released: u32,
}

impl Default for Arena {
    fn default() -> Self {
        Self { blocks: Vec::new(), released: UNKNOWN }
    }
}

impl Arena {
    pub(super) fn allocate(&mut self, block: Block) -> BlockId {
        if self.released != UNKNOWN {
            let id = BlockId(self.released);
            self.released = self[id].links[0];
            self[id] = block;
            return id;
        }
        let id = self.blocks.len();
        // This many blocks would need 256 GiB: memory is exhausted first.
        assert!(id < LEAF as usize, "an octree has at most {LEAF} blocks");
        self.blocks.push(block);
        BlockId(id as u32)
    }

    pub(super) fn release(&mut self, id: BlockId) {
        let next = self.released;
        self[id].links[0] = next;
        self.released = id.0;
    }

    pub(super) fn bytes(&self) -> usize {
        self.blocks.capacity() * Block::SIZE
    }

    /// Maximum number of bytes that were in use at once.
    pub(super) fn used_bytes(&self) -> usize {
        self.blocks.len() * Block::SIZE
    }
}

impl std::ops::Index<BlockId> for Arena {
    type Output = Block;

    fn index(&self, id: BlockId) -> &Block {
        &self.blocks[id.0 as usize]
    }
}

impl std::ops::IndexMut<BlockId> for Arena {
    fn index_mut(&mut self, id: BlockId) -> &mut Block {
        &mut self.blocks[id.0 as usize]
    }
}
