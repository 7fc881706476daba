use crate::space::{BrickCode, BrickMask};

/// Nodes of a tree under one node of 8 x 8 x 8 voxels (depth 13), as masks. Byte `k` of a mask is the `k`-th node of
/// 2 x 2 x 2 voxels (depth 15), word `k` the `k`-th node of 4 x 4 x 4 (depth 14).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrickNodes {
    /// Code of the brick.
    pub brick: BrickCode,
    /// Known voxels.
    pub known: BrickMask,
    /// Known voxels that are occupied.
    pub occupied: BrickMask,
    /// Nodes at depth 15 that are leaves: their eight voxels are known and have bit-identical values.
    pub leaves_15: u64,
    /// Nodes at depth 14 that are leaves.
    pub leaves_14: u8,
    /// Value of the whole brick, if it is one leaf.
    pub leaf: Option<f32>,
}

impl BrickNodes {
    /// Computes the nodes of an octree under a brick, and the largest value. Voxels of at least the threshold are
    /// occupied; without a threshold none is.
    ///
    /// `values_of` returns the values of a word's 64 voxels, negative infinity for unknown ones.
    #[inline]
    pub(crate) fn of_values(
        brick: BrickCode,
        known: BrickMask,
        threshold: Option<f32>,
        values_of: impl Fn(usize) -> [f32; 64],
    ) -> (Self, f32) {
        let mut nodes = Self { brick, known, occupied: [0; 8], leaves_15: 0, leaves_14: 0, leaf: None };
        let mut maxima = [f32::NEG_INFINITY; 8];
        let mut words = Uniform::default();
        for word in (0..8).filter(|&word| known[word] != 0) {
            let values = values_of(word);
            let mut bytes = Uniform::default();
            for (byte, eight) in values.as_chunks::<8>().0.iter().enumerate() {
                maxima = std::array::from_fn(|k| larger(maxima[k], eight[k]));
                if let Some(threshold) = threshold {
                    nodes.occupied[word] |= at_least(threshold, eight) << (8 * byte);
                }
                let bits = eight.map(f32::to_bits);
                if (known[word] >> (8 * byte)) as u8 == u8::MAX && bits == [bits[0]; 8] {
                    nodes.leaves_15 |= 1 << (8 * word + byte);
                    bytes.add(eight[0]);
                }
            }
            nodes.occupied[word] &= known[word];
            if let Some(value) = bytes.value_of_all() {
                nodes.leaves_14 |= 1 << word;
                words.add(value);
            }
        }
        nodes.leaf = words.value_of_all();
        (nodes, maxima.into_iter().fold(f32::NEG_INFINITY, larger))
    }

    /// Number of nodes, including the one at depth 13; 0 if no voxel is known.
    pub fn node_count(&self) -> u32 {
        let words = self.known.iter().filter(|&&word| word != 0).count() as u32;
        if words == 0 {
            return 0;
        }
        // Counts the nonzero bytes of all words at once: the bits that mark them are shifted by the number of the word,
        // so that they do not overlap.
        let bytes = (0..8).fold(0, |bytes, word| bytes | nonzero_bytes(self.known[word]) << word);
        let voxels: u32 = self.known.iter().map(|word| word.count_ones()).sum();
        let pruned =
            self.leaves_15.count_ones() + self.leaves_14.count_ones() + u32::from(self.leaf.is_some());
        1 + words + bytes.count_ones() + voxels - 8 * pruned
    }
}

/// Returns the lowest bit of each nonzero byte.
fn nonzero_bytes(word: u64) -> u64 {
    let word = word | word >> 4;
    let word = word | word >> 2;
    (word | word >> 1) & 0x0101_0101_0101_0101
}

/// Returns bit `k` for each value `k` of at least a threshold. Branchless, so that it is vectorized.
#[inline]
fn at_least(threshold: f32, values: &[f32; 8]) -> u64 {
    let bits: [u32; 8] = std::array::from_fn(|k| if values[k] >= threshold { 1 << k } else { 0 });
    u64::from(bits.iter().fold(0, |all, bit| all | bit))
}

/// Determines whether eight leaves have bit-identical values.
#[derive(Default)]
struct Uniform {
    first: f32,
    count: u8,
}

impl Uniform {
    fn add(&mut self, value: f32) {
        if self.count == 0 {
            self.first = value;
        }
        self.count += u8::from(value.to_bits() == self.first.to_bits());
    }

    fn value_of_all(&self) -> Option<f32> {
        (self.count == 8).then_some(self.first)
    }
}

#[inline]
fn larger(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}
