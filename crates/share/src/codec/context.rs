use super::prior::PRIOR;

/// Number of contexts: those of octree nodes, then those of added or removed voxels.
pub const CONTEXTS: usize = CHILD_CONTEXTS + DIRECTION_CONTEXTS;

const CHILD_CONTEXTS: usize = 8 * 4 * 4 * 4 * 8 * 2;
const DIRECTION_CONTEXTS: usize = 3 * 4 * 4;

/// The context of a bit "is this child occupied?".
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ChildContext {
    /// The child's edge is 2 to this power, in voxels.
    pub level: u32,
    /// Which child, 0 to 7.
    pub child: usize,
    /// Face neighbours of the child that are known to be occupied.
    pub full_neighbors: usize,
    /// Face neighbours of which only the parent is known to be occupied.
    pub likely_neighbors: usize,
    /// Earlier children of the same node that are occupied.
    pub full_siblings: usize,
    /// Whether the neighbour below or above is one of the occupied ones: this tells floors from walls.
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

/// The context of a bit "is this voxel added (1) or removed (0)?": the previous voxel (2 for none), and how many of the
/// neighbours so far are added and removed.
pub(super) fn direction_context(before: usize, coming: usize, going: usize) -> usize {
    CHILD_CONTEXTS + (before * 4 + coming.min(3)) * 4 + going.min(3)
}

/// Adaptive probabilities of a 1 in each context, starting from [`PRIOR`].
pub(super) struct Contexts(Vec<Context>);

#[derive(Clone, Copy)]
struct Context {
    /// Probability of a 1, in 2^-16.
    probability: u16,
    /// Number of bits that it counts for.
    count: u8,
}

/// The weight of the prior in bits: a packet's own bits soon outweigh it.
const PRIOR_COUNT: u8 = 16;
const MAX_COUNT: u8 = 60;
/// 0.3, without a prior.
const UNKNOWN: u16 = 19_661;

impl Contexts {
    pub(super) fn new() -> Self {
        let context = |&prior: &u8| match prior {
            0 => Context { probability: UNKNOWN, count: 0 },
            prior => Context { probability: u16::from(prior) << 8, count: PRIOR_COUNT },
        };
        Self(PRIOR.iter().map(context).collect())
    }

    /// Probability of a 1, in 2^-16; never 0 or 1.
    pub(super) fn probability(&self, context: usize) -> u32 {
        u32::from(self.0[context].probability).clamp(MARGIN, (1 << 16) - MARGIN)
    }

    pub(super) fn learn(&mut self, context: usize, bit: bool) {
        let context = &mut self.0[context];
        let target = if bit { i32::from(u16::MAX) } else { 0 };
        let difference = target - i32::from(context.probability);
        // A running mean with less weight for the first bits: 1 / (count + 1.5).
        let step = 2 * difference / (2 * i32::from(context.count) + 3);
        context.probability = (i32::from(context.probability) + step) as u16;
        context.count = (context.count + 1).min(MAX_COUNT);
    }
}

const MARGIN: u32 = 131;
