use crate::space::{BrickCode, MortonCode, Torus, VoxelKey};

/// Directory of the bricks of a tile. Bricks are grouped in blocks of 4 x 4 x 4, and a tile has few blocks.
#[derive(Clone, Debug)]
pub(crate) struct BrickDirectory {
    blocks: Torus,
    /// Number of each brick of a block, in Morton order, from 1; 0 if it is absent. The first block represents all
    /// absent blocks.
    numbers: Vec<[u32; BLOCK_BRICKS]>,
    /// One bit for each brick of each block, in Morton order: whether it may contain occupied voxels.
    marks: Vec<u64>,
}

const BLOCK_BRICKS: usize = 64;

/// Voxels along each side of a block.
pub(crate) const BLOCK_EDGE: i32 = 32;

impl Default for BrickDirectory {
    fn default() -> Self {
        Self { blocks: Torus::default(), numbers: vec![[0; BLOCK_BRICKS]], marks: vec![0] }
    }
}

/// Address of a voxel: its block, the brick in the block, and the position in the brick.
#[derive(Clone, Copy)]
pub(crate) struct Address {
    block: [i32; 3],
    /// Position of the brick in its block.
    pub(crate) brick: usize,
    pub(crate) place: usize,
}

impl Address {
    #[inline(always)]
    pub(crate) fn of_key(key: VoxelKey) -> Self {
        // Of the lowest five bits of a coordinate, the lower three are the position in the brick, and the upper two are
        // the position of the brick in its block.
        let part = |k: usize| SPREAD[usize::from(key.0[k] & 31)] << k;
        let code = usize::from(part(0) | part(1) | part(2));
        Self { block: key.0.map(|k| i32::from(k >> 5)), brick: code >> 9, place: code & 511 }
    }

    #[inline]
    pub(crate) fn of_code(code: MortonCode) -> Self {
        Self::of_key(code.to_key())
    }

    #[inline]
    pub(crate) fn of_brick(brick: BrickCode) -> Self {
        Self::of_code(brick.voxel(0))
    }
}

/// Moves bit `k` of an index to bit `3k`.
const SPREAD: [u16; 32] = spread();

const fn spread() -> [u16; 32] {
    let mut spread = [0; 32];
    let mut index = 0;
    while index < 32 {
        spread[index] = VoxelKey([index as u16, 0, 0]).morton().0 as u16;
        index += 1;
    }
    spread
}

impl BrickDirectory {
    pub(crate) fn bytes(&self) -> usize {
        self.blocks.bytes()
            + self.numbers.capacity() * size_of::<[u32; BLOCK_BRICKS]>()
            + self.marks.capacity() * size_of::<u64>()
    }

    /// Number of the brick at an address; 0 if it is absent.
    // A query of a point is so short that a call, and an address in memory, would take a fifth of its time.
    #[inline(always)]
    pub(crate) fn get(&self, at: Address) -> u32 {
        // Branchless, because the CPU cannot predict whether a brick exists.
        self.in_block(self.block(at), at)
    }

    #[inline(always)]
    pub(crate) fn block(&self, at: Address) -> u32 {
        self.blocks.get(at.block)
    }

    /// [`BrickDirectory::get`] with a known block number.
    #[inline]
    pub(crate) fn in_block(&self, block: u32, at: Address) -> u32 {
        self.at_place(block, at.brick)
    }

    /// Number of the brick at a position of a block; 0 if it is absent.
    #[inline]
    pub(crate) fn at_place(&self, block: u32, place: usize) -> u32 {
        self.numbers[block as usize][place]
    }

    /// Marks of the bricks of the block at an address, one bit each in Morton order.
    #[inline]
    pub(crate) fn marks(&self, at: Address) -> u64 {
        self.marked(at).1
    }

    /// Number and marks of the block at an address.
    #[inline]
    pub(crate) fn marked(&self, at: Address) -> (u32, u64) {
        let block = self.blocks.get(at.block);
        (block, self.marks[block as usize])
    }

    pub(crate) fn mark(&mut self, at: Address) {
        let block = self.blocks.get(at.block);
        if block != Torus::NONE {
            self.marks[block as usize] |= 1 << at.brick;
        }
    }

    pub(crate) fn entry(&mut self, at: Address) -> &mut u32 {
        let mut block = self.blocks.get(at.block);
        if block == Torus::NONE {
            block = self.numbers.len() as u32;
            self.blocks.insert(at.block, block);
            self.numbers.push([0; BLOCK_BRICKS]);
            self.marks.push(0);
        }
        &mut self.numbers[block as usize][at.brick]
    }
}
