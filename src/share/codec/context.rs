use super::prior::PRIOR;

/// Contexts of the bits of octree nodes, then of the bits that say whether a voxel comes or goes.
pub const CONTEXTS: usize = CHILD_CONTEXTS + DIRECTION_CONTEXTS;

const CHILD_CONTEXTS: usize = 8 * 4 * 4 * 4 * 8 * 2;
const DIRECTION_CONTEXTS: usize = 3 * 4 * 4;

/// What is known before a bit "is there anything in this child?".
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ChildContext {
    /// Edge of the child is two to this many voxels.
    pub level: u32,
    /// Which child, 0 to 7.
    pub child: usize,
    /// Face neighbors of the child that are known to hold something.
    pub full_neighbors: usize,
    /// Face neighbors of which only the parent is known, to hold something.
    pub likely_neighbors: usize,
    /// Children of the same node before this one that hold something.
    pub full_siblings: usize,
    /// Whether the neighbor below or above is one of the full ones: floors and walls differ in that.
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

/// The context of a bit "does this voxel come (1) or go (0)?": the voxel before it (2 for none), and how many of the
/// neighbors so far come and go.
pub(super) fn direction_context(before: usize, coming: usize, going: usize) -> usize {
    CHILD_CONTEXTS + (before * 4 + coming.min(3)) * 4 + going.min(3)
}

/// How likely a 1 is in each context, learned on the way; begins with [`PRIOR`].
pub(super) struct Contexts(Vec<Context>);

#[derive(Clone, Copy)]
struct Context {
    /// Of a 1, in 2^-16.
    probability: u16,
    /// How many bits it stands for.
    count: u8,
}

/// What the prior counts for: a packet's own bits soon count more.
const PRIOR_COUNT: u8 = 16;
const MAX_COUNT: u8 = 60;
/// 0.3, where there is no prior.
const UNKNOWN: u16 = 19_661;

impl Contexts {
    pub(super) fn new() -> Self {
        let context = |&prior: &u8| match prior {
            0 => Context { probability: UNKNOWN, count: 0 },
            prior => Context { probability: u16::from(prior) << 8, count: PRIOR_COUNT },
        };
        Self(PRIOR.iter().map(context).collect())
    }

    /// Of a 1, in 2^-16; never certain.
    pub(super) fn probability(&self, context: usize) -> u32 {
        u32::from(self.0[context].probability).clamp(MARGIN, (1 << 16) - MARGIN)
    }

    pub(super) fn learn(&mut self, context: usize, bit: bool) {
        let context = &mut self.0[context];
        let target = if bit { i32::from(u16::MAX) } else { 0 };
        let difference = target - i32::from(context.probability);
        // A mean of the bits so far that counts the first ones less: 1 / (count + 1.5).
        let step = 2 * difference / (2 * i32::from(context.count) + 3);
        context.probability = (i32::from(context.probability) + step) as u16;
        context.count = (context.count + 1).min(MAX_COUNT);
    }
}

const MARGIN: u32 = 131;
