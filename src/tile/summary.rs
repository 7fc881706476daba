use super::cells::CELL_VOXELS;
use crate::octree::BrickNodes;
use crate::space::{BrickCode, BrickMask};

/// What an octree needs to know of a brick: eight bytes, computed anew after the brick has changed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Summary {
    /// Largest log-odds.
    pub(super) max: f32,
    /// Nodes of OctoMap's tree, the brick's own at depth 13 included.
    pub(super) nodes: u16,
    /// Whether these are one leaf: all 512 voxels are known and have one value.
    pub(super) is_leaf: bool,
    /// Whether the brick has changed since.
    pub(super) is_stale: bool,
}

impl Summary {
    pub(super) const STALE: Self = Self { max: f32::NEG_INFINITY, nodes: 0, is_leaf: false, is_stale: true };
}

impl From<(BrickNodes, f32)> for Summary {
    fn from((nodes, max): (BrickNodes, f32)) -> Self {
        let is_leaf = nodes.leaf.is_some();
        // 585 at most.
        Self { max, nodes: nodes.node_count() as u16, is_leaf, is_stale: false }
    }
}

/// What an octree has under a brick, and the largest of its values. A voxel of at least the threshold is occupied;
/// without one none is.
///
/// `values_of` gives the values of a word's voxels, and negative infinity for those that are unknown.
#[inline]
pub(super) fn nodes_of(
    brick: BrickCode,
    known: BrickMask,
    threshold: Option<f32>,
    values_of: impl Fn(usize) -> [f32; CELL_VOXELS],
) -> (BrickNodes, f32) {
    let mut nodes = BrickNodes { brick, known, occupied: [0; 8], leaves_15: 0, leaves_14: 0, leaf: None };
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

/// Bit `k` for each value `k` of at least a threshold. Without branches, for the vector unit.
#[inline]
fn at_least(threshold: f32, values: &[f32; 8]) -> u64 {
    let bits: [u32; 8] = std::array::from_fn(|k| if values[k] >= threshold { 1 << k } else { 0 });
    u64::from(bits.iter().fold(0, |all, bit| all | bit))
}

/// Whether eight leaves have one value, to the bit.
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
pub(super) fn larger(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}
