use super::prior::PRIOR;

/// Number of contexts: first those of octree children, then those of added or removed voxels.
pub const CONTEXTS: usize = CHILD_CONTEXTS + DIRECTION_CONTEXTS;

const CHILD_CONTEXTS: usize = 8 * 4 * 4 * 4 * 8 * 2;
const DIRECTION_CONTEXTS: usize = 3 * 4 * 4;

/// Context of the bit that marks a child of an octree node as occupied.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ChildContext {
    /// The edge of the child is 2^level voxels.
    pub level: u32,
    /// Index of the child, 0 to 7.
    pub child: usize,
    /// Number of face neighbours of the child that are known to be occupied.
    pub full_neighbors: usize,
    /// Number of face neighbours of which only the parent is known to be occupied.
    pub likely_neighbors: usize,
    /// Number of earlier children of the same node that are occupied.
    pub full_siblings: usize,
    /// Whether the neighbour below or above is occupied. Distinguishes walls from floors.
    pub is_neighbor_along_z: bool,
}

impl ChildContext {
    pub(super) fn number(&self) -> usize {
        let level = self.level.min(7) as usize;
        let full = level * 4 + self.full_neighbors.min(3);
        let likely = full * 4 + self.likely_neighbors.min(3);
        let siblings = likely * 4 + self.full_siblings.min(3);
        (siblings * 8 + self.child) * 2 + usize::from(self.is_neighbor_along_z)
    }
}

/// Returns the context of the bit that marks a voxel as added (1) or removed (0). `previous` is the bit of the previous
/// voxel (2 for none); `added` and `removed` count the earlier neighbours.
pub(super) fn direction_context(previous: usize, added: usize, removed: usize) -> usize {
    CHILD_CONTEXTS + (previous * 4 + added.min(3)) * 4 + removed.min(3)
}

/// Adaptive probabilities of a 1 in each context. They start from [`PRIOR`].
pub(super) struct Contexts(Vec<Context>);

#[derive(Clone, Copy)]
struct Context {
    /// Probability of a 1, in units of 2^-16.
    probability: u16,
    /// Weight of the probability, as a number of bits.
    count: u8,
}

/// Weight of the prior, as a number of bits. The bits of a packet soon outweigh it.
const PRIOR_COUNT: u8 = 16;
const MAX_COUNT: u8 = 60;
/// Probability 0.3, for a context without a prior.
const UNKNOWN: u16 = 19_661;

impl Contexts {
    pub(super) fn new() -> Self {
        let context = |&prior: &u8| match prior {
            0 => Context { probability: UNKNOWN, count: 0 },
            prior => Context { probability: u16::from(prior) << 8, count: PRIOR_COUNT },
        };
        Self(PRIOR.iter().map(context).collect())
    }

    /// Returns the probability of a 1, in units of 2^-16; never 0 or 1.
    pub(super) fn probability(&self, context: usize) -> u32 {
        u32::from(self.0[context].probability).clamp(MARGIN, (1 << 16) - MARGIN)
    }

    pub(super) fn learn(&mut self, context: usize, bit: bool) {
        let context = &mut self.0[context];
        let target = if bit { i32::from(u16::MAX) } else { 0 };
        let difference = target - i32::from(context.probability);
        // Running mean with step 1 / (count + 1.5), which gives the first bits less weight.
        let step = 2 * difference / (2 * i32::from(context.count) + 3);
        context.probability = (i32::from(context.probability) + step) as u16;
        context.count = (context.count + 1).min(MAX_COUNT);
    }
}

const MARGIN: u32 = 131;
