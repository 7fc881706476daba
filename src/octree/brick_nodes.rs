use crate::space::{BrickCode, BrickMask};

/// What a tree has under one node of 8 x 8 x 8 voxels (depth 13), as masks: byte `k` of a mask is the `k`-th node of
/// 2 x 2 x 2 voxels (depth 15), word `k` the `k`-th node of 4 x 4 x 4 (depth 14).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrickNodes {
    /// Which node.
    pub brick: BrickCode,
    /// The voxels that are known.
    pub known: BrickMask,
    /// Those of them that count as occupied.
    pub occupied: BrickMask,
    /// The nodes at depth 15 that are leaves: their eight voxels are known and have one value, to the bit.
    pub leaves_15: u64,
    /// The nodes at depth 14 that are leaves.
    pub leaves_14: u8,
    /// The value of the whole, if it is one leaf.
    pub leaf: Option<f32>,
}

impl BrickNodes {
    /// Number of nodes, the one at depth 13 included; 0 if no voxel is known.
    pub fn node_count(&self) -> u32 {
        let words = self.known.iter().filter(|&&word| word != 0).count() as u32;
        if words == 0 {
            return 0;
        }
        // The lowest bit of each byte, moved by another place for each word, so that all are counted at once.
        let bytes = (0..8).fold(0, |bytes, word| bytes | nonzero_bytes(self.known[word]) << word);
        let voxels: u32 = self.known.iter().map(|word| word.count_ones()).sum();
        let pruned =
            self.leaves_15.count_ones() + self.leaves_14.count_ones() + u32::from(self.leaf.is_some());
        1 + words + bytes.count_ones() + voxels - 8 * pruned
    }
}

/// The lowest bit of each byte that is not zero.
fn nonzero_bytes(word: u64) -> u64 {
    let word = word | word >> 4;
    let word = word | word >> 2;
    (word | word >> 1) & 0x0101_0101_0101_0101
}
